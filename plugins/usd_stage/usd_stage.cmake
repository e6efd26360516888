# The OpenUSD reader. Its Python is that of .venv, which tools/bootstrap makes from the distribution's: another python3
# that stands first on PATH has other headers and no usd-core.
set(Python3_EXECUTABLE ${PROJECT_SOURCE_DIR}/.venv/bin/python3)
find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Embed)
set(PYBIND11_NOPYTHON ON)
find_package(pybind11 CONFIG REQUIRED)
execute_process(COMMAND ${Python3_EXECUTABLE} -c "import sys, sysconfig; print(sys.base_prefix, sysconfig.get_path('purelib'), sep=';')"
                OUTPUT_VARIABLE pythonPaths OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
list(GET pythonPaths 0 pythonHome)
list(GET pythonPaths 1 sitePackages)
set(TRILUME_PYTHON_SITE_PACKAGES ${sitePackages} CACHE PATH "Folder with usd-core that an installed package uses")
file(RELATIVE_PATH sitePackagesFromHome ${CMAKE_BINARY_DIR} ${sitePackages})

# An object library, so that tests can link the reader without loading a plugin.
file(GLOB readerSources CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/reader/*.cpp)
add_library(usd_stage_reader OBJECT ${readerSources})
set_target_properties(usd_stage_reader PROPERTIES CXX_VISIBILITY_PRESET hidden)
target_include_directories(usd_stage_reader PUBLIC ${CMAKE_CURRENT_LIST_DIR} ${PROJECT_SOURCE_DIR}/engine)
target_link_libraries(usd_stage_reader PUBLIC tl_flags fmt::fmt Python3::Python pybind11::headers ${CMAKE_DL_LIBS})
target_compile_definitions(usd_stage_reader PRIVATE
  TRILUME_PYTHON_HOME="${pythonHome}"
  TRILUME_PYTHON_SITE_PACKAGES="${TRILUME_PYTHON_SITE_PACKAGES}"
  TRILUME_PYTHON_SITE_PACKAGES_FROM_HOME="${sitePackagesFromHome}")

tl_plugin(usd_stage LIBRARIES usd_stage_reader)
# Python keeps what it has loaded; the code that it points into has to stay.
target_link_options(plugin_usd_stage PRIVATE -Wl,-z,nodelete)

set(packageDirectory lib/trilume/plugins/usd_stage/trilume_usd)
file(GLOB packageSources CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/trilume_usd/*.py)
foreach(source IN LISTS packageSources)
  cmake_path(GET source FILENAME name)
  configure_file(${source} ${CMAKE_BINARY_DIR}/${packageDirectory}/${name} COPYONLY)
endforeach()
install(FILES ${packageSources} DESTINATION ${packageDirectory})
