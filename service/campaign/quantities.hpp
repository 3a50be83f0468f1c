// Quantities of a motion that a campaign measures, by their names.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/motion.hpp"
#include "core/step/readout.hpp"

namespace freeflex::campaign {

/// Reads quantities of one motion. The names are those of the columns of `freeflex run --out FILE.csv`, and
/// some more; service/campaign/README.md lists them. Points, groups and links are read once a tick, however
/// many of their quantities are asked for. Allocates only in add().
class Quantities {
 public:
  explicit Quantities(const Plan& plan) : plan_(&plan) {}

  /// Adds a quantity; values() has them in the order in which they were added.
  /// \param reference  of the quantity `attitude`: the attitude from which the angle is measured
  /// \return why the plan does not have the quantity, or an empty text
  std::string add(const std::string& name, const std::array<double, 4>& reference);

  /// Reads all quantities. Those of the verdict have no meaning before its first tick.
  void read(const Motion& motion) noexcept;
  const std::vector<double>& values() const { return values_; }

 private:
  enum class From : std::uint8_t {
    kBody,      // part: 0 to 2 position, 3 to 6 attitude, 7 to 9 velocity, 10 to 12 spin, 13 to 15 momentum
    kAttitude,  // index into references_
    kSpin,
    kMode,  // index: place of the mode in the plan; part 0: q, 1: q_dot
    kZero,
    kWheel,
    kPoint,  // index into points_; part: 3 k + axis of position, velocity, acceleration, displacement;
             // 12 + k: their norms
    kGroup,  // index into groups_; part: 0 to 2 position, 3 to 6 attitude, 7 to 9 velocity, 10 to 12 spin
    kLink,   // index into link_values_
    kEnergy,
    kError,  // part: 0 deformation, 1 attitude, 2 position, 3 verdict
  };
  struct Source {
    From from;
    std::int32_t index = 0, part = 0;
  };
  struct LinkRows {
    std::int32_t output, first, count;
  };

  std::string add_point(const std::string& name, std::int32_t point, const std::string& part);
  std::string add_group(const std::string& name, std::int32_t group, const std::string& part);
  std::string add_link(const std::string& name, std::int32_t link, const std::string& part);
  std::string add_item(const std::string& name);
  void push(From from, std::size_t index, std::int32_t part);
  double value_of(const Source& source, const State& state, const Motion& motion) const noexcept;

  const Plan* plan_;
  std::vector<Source> sources_;
  std::vector<double> values_;
  std::vector<Quat> references_;
  std::vector<std::int32_t> points_, groups_;
  std::vector<PointState> point_states_;
  std::vector<GroupPose> group_poses_;
  std::vector<LinkRows> links_;
  std::vector<double> link_values_;
  bool has_spin_ = false, has_energy_ = false;
  Vec3 spin_{};          // [rad/s] body axes
  double energy_ = 0.0;  // [J]
};

/// Returns true if the quantity is computed only beside a verdict.
bool needs_verdict(const std::string& quantity);

}  // namespace freeflex::campaign
