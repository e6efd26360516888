#pragma once

#define TRILUME_VERSION "0.1.0"

// C++ types cross the border between engine and plugins, so both must come from the same engine version, compiler and
// standard library.
#define TL_STRINGIZE_(x) #x
#define TL_STRINGIZE(x) TL_STRINGIZE_(x)
#define TL_PLUGIN_BUILD_TAG                                                                                            \
    TRILUME_VERSION " gcc-abi " TL_STRINGIZE(__GXX_ABI_VERSION) " c++ " TL_STRINGIZE(__cplusplus)
