#pragma once

#include <stdexcept>
#include <string>

namespace trilume {

/// Whose fault it is; also the exit status of the command (contracts: 1 the run failed, 2 the command or an input is
/// bad).
enum class Fault { Run = 1, Input = 2 };

/// The one error of the engine: WHAT went wrong, WHERE (file, prim, option, device), and WHAT TO DO.
/// Printed as `trilume: error: WHAT: WHERE: what to do`. Each part is one line: line breaks become spaces; what() joins
/// the parts that are not empty.
class Error : public std::runtime_error {
public:
    Error(Fault fault, const std::string& what, const std::string& where, const std::string& hint);

    Fault fault() const { return fault_; }
    const std::string& problem() const { return problem_; }
    const std::string& where() const { return where_; }
    const std::string& hint() const { return hint_; }

private:
    struct Parts {
        std::string what, where, hint;
    };
    Error(Fault fault, Parts parts);

    Fault fault_;
    std::string problem_, where_, hint_;
};

[[nodiscard]] inline Error inputError(const std::string& what, const std::string& where, const std::string& hint) {
    return {Fault::Input, what, where, hint};
}
[[nodiscard]] inline Error runError(const std::string& what, const std::string& where, const std::string& hint) {
    return {Fault::Run, what, where, hint};
}

} // namespace trilume
