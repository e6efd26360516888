#pragma once

#include "core/error.h"

#include <gtest/gtest.h>

#include <string>

namespace trilume::test {

/// What `action` throws. Nothing thrown fails the test.
template<class Action>
Error errorOf(Action&& action) {
    try {
        action();
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << "nothing was thrown";
    return runError("", "", "");
}

/// The line that tells of a bad input. Nothing thrown, or another fault, fails the test.
template<class Action>
std::string messageOf(Action&& action) {
    const Error error = errorOf(action);
    EXPECT_EQ(error.fault(), Fault::Input);
    return error.what();
}

} // namespace trilume::test
