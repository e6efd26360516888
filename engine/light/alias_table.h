#pragma once

#include "shared/light.h"

#include <span>
#include <vector>

namespace trilume {

struct AliasTable {
    std::vector<shared::AliasEntry> entries;
    /// Of each index, as drawn from `entries` with its thresholds rounded to float: what an estimator must divide by.
    std::vector<double> probability;
};

/// Vose 1991, "A Linear Algorithm for Generating Random Numbers with a Given Distribution".
/// Weights are finite and >= 0; a weight of 0 gets probability 0, unless all are 0: then all are alike. Empty: empty.
AliasTable buildAliasTable(std::span<const double> weights);

} // namespace trilume
