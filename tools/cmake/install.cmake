# what cmake --install gives: programs, libraries, headers, message types and their document, licence, scenes, an
# example and the CMake package with its components messages and core
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/freeflex)
set(header_dir ${CMAKE_INSTALL_INCLUDEDIR}/freeflex)

# freeflex::messages needs LCM alone, so it is a component of its own
install(TARGETS freeflex_messages EXPORT freeflexMessages)
set(core_targets freeflex_options freeflex_step freeflex_scene freeflex_structure freeflex_plan freeflex_validity
  freeflex_core freeflex_io_scene freeflex_io_wire freeflex_io)
foreach(target IN LISTS core_targets)
  string(REPLACE "freeflex_" "" name ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
endforeach()
install(TARGETS ${core_targets} EXPORT freeflexCore ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
foreach(set Messages Core)
  install(EXPORT freeflex${set} NAMESPACE freeflex:: DESTINATION ${package_dir} FILE freeflex${set}Targets.cmake)
endforeach()
configure_package_config_file(tools/cmake/freeflexConfig.cmake.in ${CMAKE_BINARY_DIR}/freeflexConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/freeflexConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/freeflexConfig.cmake ${CMAKE_BINARY_DIR}/freeflexConfigVersion.cmake
  DESTINATION ${package_dir})

install(TARGETS freeflex_cli freeflex_study RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
if(TARGET freeflexd)
  install(TARGETS freeflexd RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(FILES core/command_limits.hpp core/limits.hpp core/rounding.hpp core/words.hpp DESTINATION ${header_dir}/core)
foreach(folder core/step core/scene core/structure core/plan core/validity service/io messages)
  install(DIRECTORY ${folder}/ DESTINATION ${header_dir}/${folder} FILES_MATCHING PATTERN "*.hpp")
endforeach()
install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/freeflex_msgs DESTINATION ${header_dir} FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY messages/ DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/lcm FILES_MATCHING PATTERN "*.lcm")
install(FILES messages/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/lcm)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY tests/tools/controller DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/examples)
install(DIRECTORY service/scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/freeflex/scenes)
