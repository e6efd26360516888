# Helpers for the project's own CMakeLists.

# tl_module(name DEPENDS other... LIBRARIES external...): one engine directory as a static library, so that tests can
# link what they test; all of them together make the shared library `trilume`.
function(tl_module name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;LIBRARIES" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cpp)
  if(sources)
    add_library(tl_${name} STATIC ${sources})
    set(scope PUBLIC)
    set_property(GLOBAL APPEND PROPERTY TL_MODULES tl_${name})
  else()
    add_library(tl_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(tl_${name} ${scope} ${PROJECT_SOURCE_DIR}/engine ${PROJECT_SOURCE_DIR}/engine/include
                             ${PROJECT_SOURCE_DIR}/shaders)
  list(TRANSFORM ARG_DEPENDS PREPEND tl_)
  target_link_libraries(tl_${name} ${scope} tl_flags ${ARG_DEPENDS} ${ARG_LIBRARIES})
endfunction()

# tl_plugin(name LIBRARIES external...): plugins/<name>/*.cpp as lib/trilume/plugins/<name>/ with its plugin.json.
function(tl_plugin name)
  cmake_parse_arguments(ARG "" "" "LIBRARIES" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cpp)
  set(directory lib/trilume/plugins/${name})
  add_library(plugin_${name} MODULE ${sources})
  set_target_properties(plugin_${name} PROPERTIES PREFIX "" OUTPUT_NAME ${name}
                        LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/${directory}
                        INSTALL_RPATH "$ORIGIN/../../..")
  target_link_libraries(plugin_${name} PRIVATE trilume tl_flags ${ARG_LIBRARIES})
  configure_file(${name}/plugin.json ${CMAKE_BINARY_DIR}/${directory}/plugin.json COPYONLY)
  add_dependencies(applications plugin_${name})
  install(TARGETS plugin_${name} LIBRARY DESTINATION ${directory})
  install(FILES ${name}/plugin.json DESTINATION ${directory})
endfunction()

# tl_test(kind name LIBRARIES ...): tests/<kind>/<name>.cpp as one GoogleTest program registered with ctest under the
# label <kind>.
function(tl_test kind name)
  cmake_parse_arguments(ARG "" "" "LIBRARIES" ${ARGN})
  add_executable(${name} ${CMAKE_CURRENT_SOURCE_DIR}/${kind}/${name}.cpp)
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE tl_flags ${ARG_LIBRARIES} GTest::gtest GTest::gtest_main)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>) # at -O3 tests are half of the time to build all
  add_test(NAME ${kind}/${name} COMMAND ${name})
  if(kind STREQUAL "unit")
    add_dependencies(unit_tests ${name})
  endif()
  set_tests_properties(${kind}/${name} PROPERTIES LABELS ${kind} TIMEOUT 600
                       ENVIRONMENT TRILUME_HOME=${CMAKE_BINARY_DIR})
endfunction()
