# Lints, and tests of the install space, wheels, examples and site. stage.sh builds most of these as
# ctest fixtures. Included by tests.cmake if WALKER_SIM_TEST_PYTHON is set, but not in instrumented
# builds.
set(stage ${CMAKE_CURRENT_SOURCE_DIR}/test/stage.sh)

# walker_sim_add_check(NAME LABEL COMMAND...): adds a test that passes on exit status 0.
function(walker_sim_add_check name label)
  add_test(NAME ${name} COMMAND ${ARGN})
  set_tests_properties(${name} PROPERTIES LABELS "${label};check" TIMEOUT 1500)
endfunction()

# ---------------------------------------------------------------- lints
# Lints depend on the source and on their own version, not on the platform. The distribution's lints, and
# mypy, which reads the reference's types, therefore run on Debian 12 only.
set(lint ${CMAKE_CURRENT_SOURCE_DIR}/scripts/dev/lint)
set(lints clang_format ruff rooms)
set(is_debian_12 OFF)
file(STRINGS /etc/os-release codename REGEX "^VERSION_CODENAME=")
if(codename STREQUAL "VERSION_CODENAME=bookworm")
  set(is_debian_12 ON)
endif()
if(is_debian_12)
  list(APPEND lints catkin cppcheck mypy shellcheck)
endif()
foreach(name ${lints})
  walker_sim_add_check(lint_${name} short ${lint} ${name})
endforeach()
walker_sim_add_check(lint_clang_tidy_changed short ${lint} clang_tidy)
set(tidy_parts 4)
foreach(part RANGE 1 ${tidy_parts})
  walker_sim_add_check(lint_clang_tidy_${part} long
    ${CMAKE_COMMAND} -E env TIDY_JOBS=1 ${lint} clang_tidy ${part}/${tidy_parts})
  # The longest tests start first, so that none runs alone at the end.
  set_tests_properties(lint_clang_tidy_${part} PROPERTIES COST 1)
endforeach()

# ---------------------------------------------------------------- README's first command
# Like readme_test, it first builds what is missing, so the two must not run concurrently.
walker_sim_add_check(walks long ${CMAKE_CURRENT_SOURCE_DIR}/test/walks.sh)
set_tests_properties(walks readme_test PROPERTIES RESOURCE_LOCK set_up)

# ---------------------------------------------------------------- the install space
walker_sim_add_check(install_workspace long ${stage} workspace)
set_tests_properties(install_workspace PROPERTIES FIXTURES_SETUP install_space COST 2)
foreach(path python/package_ros_test exports_test)
  get_filename_component(name ${path} NAME)
  set(results ${test_results}/install/${name}.xml)
  add_test(NAME install_${name} COMMAND ${stage} installed pytest
    ${CMAKE_CURRENT_SOURCE_DIR}/test/${path}.py ${results})
  set_tests_properties(install_${name} PROPERTIES LABELS long FIXTURES_REQUIRED install_space)
endforeach()

walker_sim_add_check(install_my_walker_pkg long ${stage} my_walker_pkg)
set_tests_properties(install_my_walker_pkg PROPERTIES FIXTURES_REQUIRED install_space)

# ---------------------------------------------------------------- pip's wheel
# One wheel per installed Python, tested with the oldest and the newest packages.
foreach(version RANGE 8 13)
  file(GLOB pythons $ENV{HOME}/.pyenv/versions/3.${version}.*/bin/python3)
  find_program(python_3_${version} NAMES python3.${version} ${pythons})
  if(NOT python_3_${version})
    continue()
  endif()
  walker_sim_add_check(wheel_3.${version} long ${stage} wheel ${python_3_${version}})
  set_tests_properties(wheel_3.${version} PROPERTIES FIXTURES_SETUP wheel_3.${version} COST 2)
  foreach(packages oldest newest)
    set(results ${test_results}/wheel/3.${version}_${packages}.xml)
    add_test(NAME wheel_3.${version}_${packages}
      COMMAND ${stage} wheel_suite ${python_3_${version}} ${packages} ${results})
    set_tests_properties(wheel_3.${version}_${packages} PROPERTIES
      LABELS long TIMEOUT 900 FIXTURES_REQUIRED wheel_3.${version})
  endforeach()
  add_test(NAME wheel_3.${version}_readme COMMAND ${stage} wheel_readme ${python_3_${version}}
    ${test_results}/wheel/3.${version}_readme.xml)
  set_tests_properties(wheel_3.${version}_readme PROPERTIES
    LABELS long TIMEOUT 900 FIXTURES_REQUIRED wheel_3.${version})
endforeach()

# The source package, and the portable wheel built from it, which is repaired and tested.
add_test(NAME scripts_wheels_test COMMAND ${WALKER_SIM_TEST_PYTHON} -m pytest -q -p no:cacheprovider
  --junit-xml=${test_results}/scripts_wheels_test.xml ${CMAKE_CURRENT_SOURCE_DIR}/test/scripts/wheels_test.py)
set_tests_properties(scripts_wheels_test PROPERTIES LABELS long TIMEOUT 1500 COST 2)

# ---------------------------------------------------------------- the documentation's site
walker_sim_add_check(docs_site long ${CMAKE_CURRENT_SOURCE_DIR}/scripts/docs)

# ---------------------------------------------------------------- examples
# Runs each file of examples/ as a user does, and the suites that need the same large packages. The
# requirements fit Debian 12's Python, PyTorch and NumPy.
function(walker_sim_add_example name learner suite)
  set(results ${test_results}/examples/${name}.xml)
  add_test(NAME examples_${name} COMMAND ${stage} example ${learner}
    ${CMAKE_CURRENT_SOURCE_DIR}/test/${suite} ${results})
  set_tests_properties(examples_${name} PROPERTIES
    LABELS long TIMEOUT 900 FIXTURES_REQUIRED examples_${learner})
endfunction()

if(is_debian_12)
  foreach(learner gymnasium ray sb3 torch)
    walker_sim_add_check(examples_set_up_${learner} long ${stage} example_venv ${learner})
    set_tests_properties(examples_set_up_${learner} PROPERTIES FIXTURES_SETUP examples_${learner})
  endforeach()
  walker_sim_add_example(sb3 sb3 python/sb3_test.py)
  walker_sim_add_example(sb3_make_vec_env sb3 python/sb3_make_vec_env_test.py)
  walker_sim_add_example(normalization sb3 python/normalization_test.py)
  walker_sim_add_example(torch torch python/torch_test.py)
  walker_sim_add_example(train sb3 python/train_test.py)
  walker_sim_add_example(sb3_ppo sb3 examples/sb3_ppo_test.py)
  walker_sim_add_example(cleanrl_ppo gymnasium examples/cleanrl_ppo_test.py)
  walker_sim_add_example(ray_rollouts ray examples/ray_rollouts_test.py)
  walker_sim_add_example(rllib_ppo ray examples/rllib_ppo_test.py)
endif()

# ---------------------------------------------------------------- suites and clients of other projects
# docs/compatibility.md lists the results.
if(is_debian_12)
  add_test(NAME python_suites_sb3 COMMAND ${stage} sb3_suite ${test_results}/python_suites_sb3.xml)
  set_tests_properties(python_suites_sb3 PROPERTIES
    LABELS long TIMEOUT 900 FIXTURES_REQUIRED examples_sb3)
  walker_sim_add_check(python_rosnodejs_set_up long ${stage} rosnodejs_modules)
  set_tests_properties(python_rosnodejs_set_up PROPERTIES FIXTURES_SETUP rosnodejs)
  add_test(NAME python_rosnodejs_test COMMAND ${stage} rosnodejs
    ${CMAKE_CURRENT_SOURCE_DIR}/test/python/rosnodejs_test.py ${test_results}/python_rosnodejs_test.xml)
  set_tests_properties(python_rosnodejs_test PROPERTIES LABELS long TIMEOUT 900 FIXTURES_REQUIRED rosnodejs)
endif()

# TorchRL's example runs in a Debian 13 root file system, with the wheel for its Python.
if(python_3_13 AND is_debian_12)
  walker_sim_add_check(examples_set_up_torchrl long ${stage} torchrl_root ${python_3_13})
  set_tests_properties(examples_set_up_torchrl PROPERTIES
    FIXTURES_SETUP examples_torchrl FIXTURES_REQUIRED wheel_3.13 COST 2)
  set(results ${test_results}/examples/torchrl_ppo.xml)
  add_test(NAME examples_torchrl_ppo COMMAND ${stage} torchrl
    ${CMAKE_CURRENT_SOURCE_DIR}/test/examples/torchrl_ppo_test.py ${results})
  set_tests_properties(examples_torchrl_ppo PROPERTIES
    LABELS long TIMEOUT 900 FIXTURES_REQUIRED examples_torchrl)
else()
  message(STATUS "examples_torchrl_ppo is left out: it needs Debian 12 and a Python 3.13")
endif()
