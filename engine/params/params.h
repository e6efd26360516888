#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace trilume {

/// bool, int64 and double print as they read; Enum holds one of `choices` as a string.
using ParamValue = std::variant<bool, int64_t, double, std::string>;

/// What a change costs: a push constant, a pipeline, or a new graph.
enum class ParamCost { Dynamic, Specialization, Structural };

/// One row per parameter. It drives `--set`, editor sliders, the C API, Python, presets and benchmark sweeps.
struct ParamRow {
    std::string name;                 ///< `node.param`, camelCase after the dot
    ParamValue defaultValue;          ///< its alternative is the parameter's type
    double minimum = 0;               ///< numbers only; inclusive
    double maximum = 0;               ///< numbers only; inclusive
    std::vector<std::string> choices; ///< non-empty: an enumeration, the value is one of these
    std::string unit;                 ///< "" when none
    std::string doc;                  ///< one sentence; names the bias that a value brings, if any
    ParamCost cost = ParamCost::Dynamic;
    bool resetsHistory = false;
    double least = 0; ///< numbers only; above 0: less of it costs noise or delay but no bias, so that a frame that
                      ///< takes too long may go down to this (ParamSet::setEffort)
};

/// The rows that a registry knows, in order of registration.
class ParamTable {
public:
    /// Throws runError when the name is taken, the default is out of range, or effort would reset history.
    void add(ParamRow row);
    const ParamRow* find(std::string_view name) const;
    std::span<const ParamRow> rows() const { return rows_; }

private:
    std::vector<ParamRow> rows_;
    std::map<std::string, size_t, std::less<>> index_;
};

/// Values over a table: technique defaults over row defaults, explicit sets over both, and effort over all.
class ParamSet {
public:
    explicit ParamSet(const ParamTable& table) : table_(&table) {}

    /// Parses `text` by the row's type (bool: 0 1 false true off on no yes). Throws inputError naming the parameter,
    /// its range or choices, and for an unknown name the nearest known one.
    void set(std::string_view name, std::string_view text);
    /// As set, but lower in precedence: what a technique brings.
    void setDefault(std::string_view name, std::string_view text);
    void clearDefaults();
    /// From 1, which leaves all values as they were set, to 0, which takes each row with a `least` down to that;
    /// between them evenly in powers.
    void setEffort(double effort);
    double effort() const { return effort_; }
    /// The natural logarithm of the largest factor between effort 1 and 0.
    double effortRange() const;

    bool getBool(std::string_view name) const;
    int64_t getInt(std::string_view name) const;
    double getFloat(std::string_view name) const;
    /// The chosen word of an enumeration.
    const std::string& getChoice(std::string_view name) const;
    /// Any value as it was set, as text that `set` would take.
    std::string getText(std::string_view name) const;

    const ParamTable& table() const { return *table_; }
    /// Grow by one with each change of an effective value: of any row, of a structural row, of a row that resets
    /// history.
    uint64_t revision() const { return revision_; }
    uint64_t structuralRevision() const { return structuralRevision_; }
    uint64_t historyRevision() const { return historyRevision_; }

private:
    using Values = std::map<std::string, ParamValue, std::less<>>;

    const ParamValue& value(std::string_view name) const;
    const ParamValue& valueSet(std::string_view name) const; ///< before effort
    void govern(const ParamRow& row);
    void store(Values& values, std::string_view name, std::string_view text);
    void noteChange(const ParamRow& row, const ParamValue& before);

    const ParamTable* table_;
    Values defaults_, values_, governed_;
    double effort_ = 1;
    uint64_t revision_ = 0, structuralRevision_ = 0, historyRevision_ = 0;
};

} // namespace trilume
