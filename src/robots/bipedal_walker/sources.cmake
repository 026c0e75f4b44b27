walker_sim_sources(core_sources
  bipedal_walker canvas heuristic kernel/kernel kernel/trial lidar observation physics registration renderer reward saved_state specification terrain)
foreach(name swept_vertices together world_shortcuts world_state world_step world_toi)
  walker_sim_sources(core_sources box2d_pinned/${name})
endforeach()
list(APPEND core_sources ${bipedal_walker_kernels})
