# By pkg-config: Debian's CMake package of OpenImageIO asks for its command-line tools and for OpenCV as well.
find_package(PkgConfig REQUIRED)
pkg_check_modules(OpenImageIO REQUIRED IMPORTED_TARGET OpenImageIO)
tl_plugin(image_io LIBRARIES PkgConfig::OpenImageIO)
