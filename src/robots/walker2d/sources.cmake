walker_sim_sources(core_sources
  kernel/coverage kernel/kernel kernel/kernel_physics kernel/trial kernel/trigonometry registration)
list(APPEND core_sources ${walker2d_constants} ${walker2d_kernels})
