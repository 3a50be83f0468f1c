// The objects behind the handles of the C interface, and its error codes.
#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "core/motion.hpp"
#include "service/c/freeflex.h"
#include "service/campaign/case.hpp"

namespace freeflex::c_interface {

using PlanData = campaign::CasePlan;

extern thread_local std::string last_error;

/// Stores the text for freeflex_last_error() and returns the code.
int fail(int code, const std::string& text) noexcept;

/// Runs a call and returns its code. If the call throws, returns the code for the exception.
template <typename Call>
int guarded(const Call& call) noexcept {
  try {
    return call();
  } catch (const std::bad_alloc&) {
    return fail(FREEFLEX_NO_MEMORY, "memory ran out");
  } catch (const std::exception& error) {
    return fail(FREEFLEX_INTERNAL, std::string("the library has an internal error: ") + error.what());
  }
}

}  // namespace freeflex::c_interface

struct freeflex_plan {
  std::shared_ptr<const freeflex::c_interface::PlanData> data;
  std::string warnings;
};

struct freeflex_motion {
  freeflex_motion(std::shared_ptr<const freeflex::c_interface::PlanData> given, freeflex::Watch watch)
      : data(std::move(given)), motion(data->plan, watch) {}
  // a copy is not in use by any call
  freeflex_motion(const freeflex_motion& other)
      : data(other.data), motion(other.motion), pending(other.pending), sequence(other.sequence) {}

  const freeflex::Plan& plan() const { return data->plan; }

  std::shared_ptr<const freeflex::c_interface::PlanData> data;
  freeflex::Motion motion;
  // commands for the next step, at most service::CommandQueue::kMaxPending
  std::vector<freeflex::ForceCommand> pending;
  std::int64_t sequence = 0;
  mutable std::atomic_flag is_entered;  // set while a call uses this motion
};
