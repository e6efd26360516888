# No link to Open Image Denoise: its library is loaded when first asked for. After usd_stage, which finds the folders.
tl_plugin(oidn LIBRARIES ${CMAKE_DL_LIBS})
target_compile_definitions(plugin_oidn PRIVATE
  TRILUME_PYTHON_SITE_PACKAGES="${TRILUME_PYTHON_SITE_PACKAGES}"
  TRILUME_PYTHON_SITE_PACKAGES_FROM_HOME="${sitePackagesFromHome}")
