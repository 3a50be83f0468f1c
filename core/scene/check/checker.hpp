// This code is shared by check_scene and check_links. It holds a scene, the faults of the scene, and the text
// of common faults.
#pragma once

#include <cmath>
#include <string>

#include "core/faults.hpp"

namespace freeflex {

struct Checker {
  const Scene& scene;
  Faults& faults;

  bool is_point(int index) const { return index >= 0 && index < static_cast<int>(scene.points.size()); }
  bool is_group(int index) const { return index >= 0 && index < static_cast<int>(scene.groups.size()); }
  const PointMass& point(int index) const { return scene.points[static_cast<std::size_t>(index)]; }

  void error(const Origin& origin, const std::string& message) { add_error(faults, origin, message); }

  void positive(const Origin& origin, const std::string& what, double value, const char* unit) {
    if (!(std::isfinite(value) && value > 0.0))
      error(origin, join_text(what, " is ", value, " ", unit, ", but must be finite and > 0"));
  }
  void not_negative(const Origin& origin, const std::string& what, double value, const char* unit) {
    if (!(std::isfinite(value) && value >= 0.0))
      error(origin, join_text(what, " is ", value, " ", unit, ", but must be finite and >= 0"));
  }
  void finite(const Origin& origin, const std::string& what,
              const Eigen::Ref<const Eigen::VectorXd>& values) {
    if (!values.allFinite())
      error(origin, join_text(what, " is (", values.transpose(), "), but must be finite"));
  }
  bool known_point(const Origin& origin, const std::string& what, int index) {
    if (is_point(index)) return true;
    error(origin, join_text(what, " names point index ", index, ", but there are ", scene.points.size(),
                            " points, numbered from 0"));
    return false;
  }
  bool known_group(const Origin& origin, const std::string& what, int index) {
    if (is_group(index)) return true;
    error(origin, join_text(what, " names group index ", index, ", but there are ", scene.groups.size(),
                            " groups, numbered from 0"));
    return false;
  }

  void check_points();
  void check_link(const Link& link, int index);
  void check_resolution();
  void check_link_points(const Link& link, const std::string& who);
  void check_beam(const Link& link, const Beam& beam, const std::string& who);
  void check_plate(const Link& link, const Plate& plate, const std::string& who);
  void check_torsion(const Link& link, const std::string& who);
  void check_matrix_link(const Link& link, const MatrixLink& matrix, const std::string& who);
  void check_dissipation(const Link& link, const std::string& who);
  void check_group(const Group& group, int index);
  void check_wheels();
  void check_damping();
  void check_load(const Load& load, int index);
  void check_history(const Load& load, const std::string& who);
  void check_feedback(const Feedback& feedback, int index);
  void check_attractor();
  void check_initial();
  void check_publication();
};

}  // namespace freeflex
