// The session number identifies this daemon on the bus. It also decides which of two daemons on one prefix
// continues.
#pragma once

#include <cstdint>

namespace freeflex::service {

/// Returns a positive number that no other daemon has. The number is the wall clock [ns] with the process id
/// in the low 20 bits. A daemon that starts later has a larger number.
std::int64_t make_session();

}  // namespace freeflex::service
