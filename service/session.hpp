// Who this daemon is on the bus, and which of two on one prefix stays.
#pragma once

#include <cstdint>

namespace freeflex::service {

/// A positive number no other daemon has: wall clock [ns] with the process id in its low 20 bits. A daemon
/// started later has the larger one.
std::int64_t make_session();

}  // namespace freeflex::service
