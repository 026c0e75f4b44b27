walker_sim_sources(core_sources
  bipedal_walker canvas heuristic kernel/kernel kernel/trial lidar observation observation_builder
  physics registration renderer reward saved_state specification terrain)
foreach(name body_list broad_phase cast_rays swept_vertices together world_impacts world_state world_step)
  walker_sim_sources(core_sources box2d_pinned/${name})
endforeach()
list(APPEND core_sources ${bipedal_walker_kernels})
