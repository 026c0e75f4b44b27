# Lints, and tests of the install space, wheels, examples and site. stage.sh builds most of these as
# ctest fixtures. Included by tests.cmake if WALKER_SIM_TEST_PYTHON is set, but not in instrumented
# builds.
set(stage ${CMAKE_CURRENT_SOURCE_DIR}/test/stage.sh)

# walker_sim_add_stage(NAME LABEL [MAKES FIXTURE] [NEEDS FIXTURE] COMMAND WORD...)
function(walker_sim_add_stage name label)
  cmake_parse_arguments(add "" "MAKES;NEEDS" "COMMAND" ${ARGN})
  add_test(NAME ${name} COMMAND ${add_COMMAND})
  set_tests_properties(${name} PROPERTIES LABELS ${label} TIMEOUT 1500
    FIXTURES_SETUP "${add_MAKES}" FIXTURES_REQUIRED "${add_NEEDS}")
endfunction()

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
  walker_sim_add_stage(lint_${name} short COMMAND ${lint} ${name})
endforeach()
if(is_debian_12)
  walker_sim_add_stage(lint_actionlint long COMMAND ${lint} actionlint) # first downloads 70 MB
endif()
walker_sim_add_stage(lint_clang_tidy_changed short COMMAND ${lint} clang_tidy)
walker_sim_add_stage(lint_clang_tidy nightly COMMAND ${lint} clang_tidy all)
set_tests_properties(lint_clang_tidy PROPERTIES TIMEOUT 5400)

# README's first command. Like readme_test, it first builds what is missing, so the two must not run concurrently.
walker_sim_add_stage(walks long COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/walks.sh)
set_tests_properties(walks readme_test PROPERTIES RESOURCE_LOCK set_up)

walker_sim_add_stage(install_workspace long MAKES install_space COMMAND ${stage} workspace)
set_tests_properties(install_workspace PROPERTIES COST 2)
foreach(path python/package_ros_test exports_test)
  get_filename_component(name ${path} NAME)
  walker_sim_add_stage(install_${name} long NEEDS install_space
    COMMAND ${stage} installed pytest ${CMAKE_CURRENT_SOURCE_DIR}/test/${path}.py)
endforeach()
walker_sim_add_stage(install_my_walker_pkg long NEEDS install_space COMMAND ${stage} my_walker_pkg)

# Every target, tests included, with the compilers and headers of other releases, in roots that only root can make.
# One at a time, and after tests that wait for the processor, because some have time limits.
execute_process(COMMAND id -u OUTPUT_VARIABLE user OUTPUT_STRIP_TRAILING_WHITESPACE)
if(is_debian_12 AND user EQUAL 0)
  foreach(suite bullseye trixie)
    walker_sim_add_stage(compiles_on_${suite} long
      COMMAND nice -n 19 ${CMAKE_CURRENT_SOURCE_DIR}/scripts/dev/compile ${suite})
    set_tests_properties(compiles_on_${suite} PROPERTIES COST 3 TIMEOUT 3600 RESOURCE_LOCK debian_root)
  endforeach()
else()
  message(STATUS "compiles_on_bullseye and compiles_on_trixie are left out: they need Debian 12 and root")
endif()

# pip's wheel: one per installed Python, tested with the oldest and the newest packages. Only the oldest and the
# newest Python are not nightly.
set(versions "")
foreach(version RANGE 8 13)
  file(GLOB pythons $ENV{HOME}/.pyenv/versions/3.${version}.*/bin/python3)
  find_program(python_3_${version} NAMES python3.${version} ${pythons})
  if(python_3_${version})
    list(APPEND versions ${version})
  endif()
endforeach()
foreach(version ${versions})
  set(python ${python_3_${version}})
  list(GET versions 0 oldest)
  list(GET versions -1 newest)
  set(label nightly)
  if(version EQUAL oldest OR version EQUAL newest)
    set(label long)
  endif()
  set(wheel wheel_3.${version})
  walker_sim_add_stage(${wheel} ${label} MAKES ${wheel} COMMAND ${stage} wheel ${python})
  set_tests_properties(${wheel} PROPERTIES COST 2)
  foreach(age oldest newest)
    walker_sim_add_stage(${wheel}_${age} ${label} NEEDS ${wheel}
      COMMAND ${stage} wheel_suite ${python} ${age})
  endforeach()
  walker_sim_add_stage(${wheel}_readme ${label} NEEDS ${wheel} COMMAND ${stage} wheel_readme ${python})
endforeach()

# The source package, and the portable wheel built from it, which is repaired and tested.
walker_sim_add_stage(scripts_wheels_test nightly COMMAND ${WALKER_SIM_TEST_PYTHON} -m pytest -q
  -p no:cacheprovider ${CMAKE_CURRENT_SOURCE_DIR}/test/scripts/wheels_test.py)

walker_sim_add_stage(docs_site long COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/scripts/docs)

# walker_sim_add_examples(LEARNER LABEL SUITE...): runs files of examples/ as a user does, and suites that
# need the same large packages. The requirements fit Debian 12's Python, PyTorch and NumPy.
function(walker_sim_add_examples learner label)
  walker_sim_add_stage(examples_set_up_${learner} ${label} MAKES examples_${learner}
    COMMAND ${stage} example_venv ${learner})
  foreach(suite ${ARGN})
    get_filename_component(name ${suite} NAME)
    walker_sim_add_stage(examples_${name} ${label} NEEDS examples_${learner}
      COMMAND ${stage} example ${learner} ${CMAKE_CURRENT_SOURCE_DIR}/test/${suite}_test.py)
  endforeach()
endfunction()

if(is_debian_12)
  walker_sim_add_examples(exchange long python/minari python/onnx python/onnx_reader)
  walker_sim_add_examples(gymnasium long examples/cleanrl_ppo)
  walker_sim_add_examples(ray nightly examples/ray_rollouts examples/rllib_ppo)
  walker_sim_add_examples(sb3 long python/curriculum python/history python/normalization python/sb3
    python/sb3_make_vec_env python/sb3_models python/sb3_promises python/sb3_worlds python/train
    examples/sb3_ppo)
  walker_sim_add_examples(torch long python/torch)
endif()

# Chromium without a display.
if(is_debian_12)
  walker_sim_add_stage(page_set_up long MAKES page COMMAND ${stage} page_venv)
  foreach(suite web web_ros web_server)
    walker_sim_add_stage(python_${suite}_test long NEEDS page
      COMMAND ${stage} page ${CMAKE_CURRENT_SOURCE_DIR}/test/python/${suite}_test.py)
  endforeach()
endif()

# Suites and clients of other projects; docs/compatibility.md lists the results.
if(is_debian_12)
  walker_sim_add_stage(python_suites_sb3 long NEEDS examples_sb3 COMMAND ${stage} sb3_suite)
  walker_sim_add_stage(python_rosnodejs_set_up long MAKES rosnodejs COMMAND ${stage} rosnodejs_modules)
  walker_sim_add_stage(python_rosnodejs_test long NEEDS rosnodejs
    COMMAND ${stage} rosnodejs ${CMAKE_CURRENT_SOURCE_DIR}/test/python/rosnodejs_test.py)
endif()

# TorchRL's example runs in a Debian 13 root file system, with the wheel for its Python.
if(python_3_13 AND is_debian_12)
  walker_sim_add_stage(examples_set_up_torchrl nightly MAKES examples_torchrl NEEDS wheel_3.13
    COMMAND ${stage} torchrl_root ${python_3_13})
  set_tests_properties(examples_set_up_torchrl PROPERTIES COST 2)
  walker_sim_add_stage(examples_torchrl_ppo nightly NEEDS examples_torchrl
    COMMAND ${stage} torchrl ${CMAKE_CURRENT_SOURCE_DIR}/test/examples/torchrl_ppo_test.py)
else()
  message(STATUS "examples_torchrl_ppo is left out: it needs Debian 12 and a Python 3.13")
endif()
