walker_sim_sources(core_sources kernel/kernel kernel/kernel_physics kernel/trial registration)
list(APPEND core_sources ${walker2d_constants} ${walker2d_kernels})
