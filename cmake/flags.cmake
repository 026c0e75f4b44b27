# walker_sim_flags: compiler and linker options of our own code.
add_library(walker_sim_flags INTERFACE)
# No fused multiply-add and no sine or cosine folded at compile time: both would change bits.
target_compile_options(walker_sim_flags INTERFACE
  -ffp-contract=off -fno-builtin-sin -fno-builtin-cos -Wall -Wextra -Wpedantic -Wshadow
  -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast)
if(WALKER_SIM_WERROR)
  target_compile_options(walker_sim_flags INTERFACE -Werror)
endif()

# Hardening: read-only relocations, a non-executable stack, position-independent executables.
target_link_options(walker_sim_flags INTERFACE -Wl,-z,relro -Wl,-z,now -Wl,-z,noexecstack
  "$<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>")
# Hardening: stack protector and fortified C library functions.
if(WALKER_SIM_INSTRUMENT)
  include(test/instrument.cmake)
else()
  target_compile_options(walker_sim_flags INTERFACE -fstack-protector-strong
    "$<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
endif()
