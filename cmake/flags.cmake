# walker_sim_flags: how our own code is compiled and linked.
add_library(walker_sim_flags INTERFACE)
# No fused multiply-add and no sine folded at compile time: both would change bits.
target_compile_options(walker_sim_flags INTERFACE
  -ffp-contract=off -fno-builtin-sin -fno-builtin-cos -Wall -Wextra -Wpedantic -Wshadow
  -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast)
if(WALKER_SIM_WERROR)
  target_compile_options(walker_sim_flags INTERFACE -Werror)
endif()

# Tables of functions that nobody writes to once a program runs, a stack that is never code, and programs at
# addresses that nobody knows before.
target_link_options(walker_sim_flags INTERFACE -Wl,-z,relro -Wl,-z,now -Wl,-z,noexecstack
  "$<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>")
# And a function that writes beyond its arrays ends the program before it returns; the C library's own
# look at the size of what they write to, where the compiler knows it.
if(WALKER_SIM_INSTRUMENT)
  include(test/instrument.cmake)
else()
  target_compile_options(walker_sim_flags INTERFACE -fstack-protector-strong
    "$<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
endif()
