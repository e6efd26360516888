#include "interruption.h"

#include <csignal>

namespace trilume::cli {
namespace {

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

void handle(int) { interrupted = true; }

void setHandler(void (*handler)(int)) {
    struct sigaction action {};
    action.sa_handler = handler;
    action.sa_flags = SA_RESETHAND | SA_RESTART;
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
}

} // namespace

Interruption::Interruption() { setHandler(handle); }
Interruption::~Interruption() { setHandler(SIG_DFL); }
const std::atomic<bool>& Interruption::flag() { return interrupted; }

} // namespace trilume::cli
