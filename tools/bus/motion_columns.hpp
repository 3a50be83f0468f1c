// Names and quantities of the columns of a motion in a table.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace freeflex::tools {

using Columns = std::vector<std::string>;

/// Returns the names of the columns of a state, in the order of state_t: time; pose, velocities and angular
/// momentum of the body; q and q_dot of the modes; momenta of the wheels.
Columns state_columns(int num_elastic, const std::vector<std::string>& wheels);
/// Appends the columns of point.NAME: position, velocity and acceleration. For a body, also appends attitude
/// and angular velocity.
void append_point_columns(const std::string& name, bool is_body, Columns& columns);
/// Appends the columns of group.NAME: position, attitude, velocity, angular velocity.
void append_group_columns(const std::string& name, Columns& columns);
/// Appends the columns of link.NAME, which depend on the kind of the link.
void append_link_columns(const std::string& name, std::string_view kind, int num_values, Columns& columns);

/// Returns the quantity of each column, with its unit: "points: velocity [m/s]". The names of numbered values
/// of a link do not tell the kind of the link, so value k of all links with the same number of values is one
/// quantity. A column whose name `freeflex run` does not use is a quantity of its own.
std::vector<std::string> quantities_of(const Columns& columns);

}  // namespace freeflex::tools
