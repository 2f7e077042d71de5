# `cmake --install` gives the programs, and the client library with a CMake package: another project finds it with
# find_package(fanstream) and links fanstream::client (or ::protocol, ::common). Included last, when all targets exist.
# `cmake --install --component programs` leaves the library out.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/fanstream)
set(header_dir ${CMAKE_INSTALL_INCLUDEDIR}/fanstream)

# Headers include each other relative to the repository's root, so that root is what include/fanstream stands for.
target_include_directories(fanstream_options INTERFACE $<INSTALL_INTERFACE:${header_dir}>)
target_compile_features(fanstream_options INTERFACE cxx_std_20)

set(library_targets fanstream_options fanstream_common fanstream_protocol fanstream_client)
foreach(target IN LISTS library_targets)
  string(REPLACE "fanstream_" "" name ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
endforeach()
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
install(TARGETS ${library_targets} EXPORT fanstream ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY common protocol client DESTINATION ${header_dir} FILES_MATCHING
  PATTERN "*.h" PATTERN common/install EXCLUDE PATTERN common/import EXCLUDE PATTERN client/commands EXCLUDE)
install(EXPORT fanstream NAMESPACE fanstream:: FILE fanstreamTargets.cmake DESTINATION ${package_dir})

# Whoever links the libraries needs what they are linked with: each is found by the namespace of its targets. FCL's
# target has none.
set(dependencies)
foreach(target IN LISTS library_targets)
  get_target_property(linked ${target} INTERFACE_LINK_LIBRARIES)
  string(REGEX MATCHALL "[A-Za-z0-9_]+::" namespaces "${linked}")
  list(APPEND dependencies ${namespaces})
  if("${linked}" MATCHES "<LINK_ONLY:fcl>")
    list(APPEND dependencies "fcl::")
  endif()
endforeach()
list(REMOVE_DUPLICATES dependencies)
list(SORT dependencies)
list(TRANSFORM dependencies REPLACE "(.+)::" "find_dependency(\\1)")
list(JOIN dependencies "\n" dependency_calls)

foreach(program fanstream-server fanstream-client fanstream-load)
  if(TARGET ${program})
    install(TARGETS ${program} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
  endif()
endforeach()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/fanstreamConfig.cmake.in
  ${PROJECT_BINARY_DIR}/fanstreamConfig.cmake INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/fanstreamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/fanstreamConfig.cmake ${PROJECT_BINARY_DIR}/fanstreamConfigVersion.cmake
  DESTINATION ${package_dir})
