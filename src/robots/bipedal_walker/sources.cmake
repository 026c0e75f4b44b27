walker_sim_sources(core_sources
  bipedal_walker heuristic kernel/kernel observation physics registration renderer specification terrain)
foreach(name world_shortcuts world_state world_step)
  walker_sim_sources(core_sources box2d_pinned/${name})
endforeach()
list(APPEND core_sources ${bipedal_walker_kernels})
