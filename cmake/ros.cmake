# The libraries and programs of the ROS package.
walker_sim_sources(agents_sources agents)
walker_sim_sources(server_sources description ros server)
list(REMOVE_ITEM server_sources ${drawing_sources})
walker_sim_sources(replay_sources replay)
add_library(walker_sim_agents STATIC ${agents_sources})
add_library(walker_sim_server STATIC ${server_sources})
find_library(TINYXML2_LIBRARY tinyxml2)
target_link_libraries(walker_sim_server
  PUBLIC walker_sim_drawing walker_sim_wire Eigen3::Eigen PRIVATE ${TINYXML2_LIBRARY})
# The server itself reads no bags.
find_package(rosbag_storage REQUIRED)
add_library(walker_sim_replay STATIC ${replay_sources})
target_include_directories(walker_sim_replay SYSTEM PUBLIC ${rosbag_storage_INCLUDE_DIRS})
target_link_libraries(walker_sim_replay PUBLIC walker_sim_server ${rosbag_storage_LIBRARIES})
foreach(library walker_sim_agents walker_sim_replay walker_sim_server)
  target_compile_definitions(${library} PUBLIC ${ros_definitions})
  target_include_directories(${library} PUBLIC src)
  target_include_directories(${library}
    SYSTEM PUBLIC ${ros_include_directories} ${catkin_INCLUDE_DIRS})
  target_link_libraries(${library}
    PUBLIC walker_sim_core ${catkin_LIBRARIES} Threads::Threads PRIVATE walker_sim_flags)
  add_dependencies(${library} ${PROJECT_NAME}_generate_messages_cpp)
endforeach()
foreach(node describe replay server service_agent status_line topic_agent)
  add_executable(walker_sim_${node}_node src/nodes/${node}.cpp)
  set_target_properties(walker_sim_${node}_node PROPERTIES OUTPUT_NAME ${node})
  target_link_libraries(walker_sim_${node}_node
    PRIVATE walker_sim_agents walker_sim_server walker_sim_flags)
  list(APPEND node_targets walker_sim_${node}_node)
endforeach()
target_link_libraries(walker_sim_replay_node PRIVATE walker_sim_replay)
# The programs that ./scripts/run starts, and the Python messages that rosservice and rostopic need.
add_custom_target(walker_sim_nodes DEPENDS ${node_targets} ${PROJECT_NAME}_generate_messages_py)
