#pragma once

#include <cstdint>
#include <vector>

namespace trilume {

/// The words that FrameConstants::bsdfTables points to, laid out as in shaders/shared/bsdf_tables.h: energy that single
/// scattering by GGX surfaces loses, which the BSDF library gives back. 45 KB, the same for every scene.
std::vector<uint32_t> bsdfTables();

} // namespace trilume
