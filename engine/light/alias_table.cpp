#include "light/alias_table.h"

#include <numeric>

namespace trilume {

AliasTable buildAliasTable(std::span<const double> weights) {
    const size_t count = weights.size();
    AliasTable table;
    table.entries.resize(count);
    table.probability.assign(count, 0.0);
    if (count == 0) return table;

    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    std::vector<double> scaled(count, 1.0); // share of an entry's height; 1 is the mean
    std::vector<uint32_t> small, large;
    for (uint32_t i = 0; i < count; ++i) {
        if (total > 0) scaled[i] = weights[i] / total * double(count);
        (scaled[i] < 1 ? small : large).push_back(i);
    }
    while (!small.empty() && !large.empty()) {
        const uint32_t low = small.back(), high = large.back();
        small.pop_back();
        table.entries[low] = {static_cast<float>(scaled[low]), high};
        scaled[high] -= 1 - scaled[low];
        if (scaled[high] < 1) {
            large.pop_back();
            small.push_back(high);
        }
    }
    // What is left is full but for rounding. A zero weight cannot be among it while any weight is positive: it would
    // have been paired with an entry above the mean.
    for (const uint32_t i : large) table.entries[i] = {1.0f, i};
    for (const uint32_t i : small) table.entries[i] = {1.0f, i};

    for (uint32_t i = 0; i < count; ++i) {
        const double threshold = table.entries[i].threshold;
        table.probability[i] += threshold / double(count);
        table.probability[table.entries[i].alias] += (1 - threshold) / double(count);
    }
    return table;
}

} // namespace trilume
