#include "tools/bus/motion_columns.hpp"

#include <algorithm>
#include <array>
#include <unordered_map>

#include "core/words.hpp"

namespace freeflex::tools {
namespace {

constexpr std::array kAxes{"x", "y", "z"};
constexpr std::array kQuaternion{"qw", "qx", "qy", "qz"};

// a comma in a name would split its column
std::string without_commas(std::string name) {
  std::replace(name.begin(), name.end(), ',', '_');
  return name;
}

void append_axes(const std::string& front, const char* letter, Columns& columns) {
  for (const char* axis : kAxes) columns.push_back(front + letter + axis);
}

void append_quaternion(const std::string& front, Columns& columns) {
  for (const char* component : kQuaternion) columns.push_back(front + component);
}

bool is_number(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

bool is_one_of(std::string_view text, std::string_view letter) {
  return text.size() == letter.size() + 1 && text.starts_with(letter) &&
         std::string_view("xyz").find(text.back()) != std::string_view::npos;
}

// returns the quantity of a column x, qw, vx, ax, wx and so on, or an empty text for any other column
std::string_view kinematic(std::string_view last) {
  if (is_one_of(last, "")) return "position [m]";
  if (last == "qw" || is_one_of(last, "q")) return "attitude [-]";
  if (is_one_of(last, "v")) return "velocity [m/s]";
  if (is_one_of(last, "a")) return "acceleration [m/s^2]";
  if (is_one_of(last, "w")) return "angular velocity [rad/s]";
  return {};
}

}  // namespace

Columns state_columns(int num_elastic, const std::vector<std::string>& wheels) {
  Columns columns{"time"};
  append_axes("", "", columns);
  append_quaternion("", columns);
  for (const char* letter : {"v", "w", "h"}) append_axes("", letter, columns);
  for (const char* name : {"q", "q_dot"})
    for (int mode = 1; mode <= num_elastic; ++mode) columns.push_back(name + std::to_string(mode));
  for (const std::string& wheel : wheels) columns.push_back("wheel." + without_commas(wheel) + ".momentum");
  return columns;
}

// dots in NAME do not make two column names equal, because the parts before and after NAME contain no dots

void append_point_columns(const std::string& name, bool is_body, Columns& columns) {
  const std::string front = "point." + without_commas(name) + ".";
  for (const char* letter : {"", "v", "a"}) append_axes(front, letter, columns);
  if (!is_body) return;
  append_quaternion(front, columns);
  append_axes(front, "w", columns);
}

void append_group_columns(const std::string& name, Columns& columns) {
  const std::string front = "group." + without_commas(name) + ".";
  append_axes(front, "", columns);
  append_quaternion(front, columns);
  for (const char* letter : {"v", "w"}) append_axes(front, letter, columns);
}

void append_link_columns(const std::string& name, std::string_view kind, int num_values, Columns& columns) {
  const std::string front = "link." + without_commas(name) + ".";
  const LinkTypeTraits* const type = find_link_type(kind);
  if (num_values == 1) columns.push_back(front + (type != nullptr && type->is_angular ? "moment" : "axial"));
  for (int k = 1; k <= num_values && num_values > 1; ++k) columns.push_back(front + std::to_string(k));
}

namespace {

std::string quantity_of(std::string_view column) {
  const std::string_view last = column.substr(column.rfind('.') + 1);
  if (column == "time") return "time [s]";
  if (column.starts_with("wheel.") && last == "momentum") return "wheels: momentum [N m s]";
  if (column.starts_with("link.")) {
    if (last == "axial") return "links: tension [N]";
    if (last == "moment") return "links: moment [N m]";
  }
  const std::string_view measure = kinematic(last);
  if (column.starts_with("point.") && !measure.empty()) return "points: " + std::string(measure);
  if (column.starts_with("group.") && !measure.empty()) return "groups: " + std::string(measure);
  if (column.find('.') != std::string_view::npos) return std::string(column);
  if (!measure.empty()) return std::string(measure);
  if (is_one_of(column, "h")) return "angular momentum [kg m^2/s]";
  if (column.starts_with("q_dot") && is_number(column.substr(5))) return "elastic rates [m/s]";
  if (column.starts_with("q") && is_number(column.substr(1))) return "elastic coordinates [m]";
  return std::string(column);
}

}  // namespace

std::vector<std::string> quantities_of(const Columns& columns) {
  const auto is_value = [](const std::string& column) {
    return column.starts_with("link.") && is_number(column.substr(column.rfind('.') + 1));
  };
  std::unordered_map<std::string, int> num_values;  // number of values of each link, by its name
  for (const std::string& column : columns)
    if (is_value(column)) ++num_values[column.substr(0, column.rfind('.'))];
  std::vector<std::string> quantities;
  quantities.reserve(columns.size());
  for (const std::string& column : columns)
    quantities.push_back(is_value(column)
                             ? "links of " + std::to_string(num_values[column.substr(0, column.rfind('.'))]) +
                                   " values: " + column.substr(column.rfind('.') + 1)
                             : quantity_of(column));
  return quantities;
}

}  // namespace freeflex::tools
