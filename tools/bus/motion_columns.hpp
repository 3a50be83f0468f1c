// Names of the columns of a motion in a table, and what each measures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace freeflex::tools {

using Columns = std::vector<std::string>;

/// time, the frame, q and q_dot of the modes, momenta of the wheels: the order of state_t.
Columns state_columns(int num_elastic, const std::vector<std::string>& wheels);
/// point.NAME: place, velocity, acceleration; of a body attitude and rate behind them.
void append_point_columns(const std::string& name, bool is_body, Columns& columns);
/// group.NAME: place, attitude, velocity, rate.
void append_group_columns(const std::string& name, Columns& columns);
/// link.NAME: its values, by its kind.
void append_link_columns(const std::string& name, std::string_view kind, int num_values, Columns& columns);

/// What each column measures, with its unit: "points: velocity [m/s]". Values of links whose kind a name does
/// not tell are one quantity where they have one number and their links equally many; a name that none of the
/// above gives is a quantity of its own.
std::vector<std::string> quantities_of(const Columns& columns);

}  // namespace freeflex::tools
