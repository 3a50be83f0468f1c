// Describes scenes that must be refused: their files and the exact text of every message.
#pragma once

#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <utility>
#include <vector>

namespace freeflex::testing {

struct BadScene {
  std::string name;  // description of the fault
  std::vector<std::pair<std::string, std::string>>
      files;                          // name and bytes of each file; scene.yaml is the scene
  std::vector<std::string> messages;  // "file:line:column: severity: text", in order
};

inline void PrintTo(const BadScene& scene, std::ostream* out) { *out << scene.name; }
inline std::string bad_scene_name(const ::testing::TestParamInfo<BadScene>& info) { return info.param.name; }

/// Loads the scene as a plan in a temporary folder and compares all messages.
void expect_refused(const BadScene& scene);

/// Holds four lines of text with three points. The point hub is at the origin, mid is 1 m from hub along x,
/// and tip is 1 m from mid along y.
inline const std::string kThreePoints =
    "points:\n"
    "  - {name: hub, mass: 10, at: [0, 0, 0]}\n"
    "  - {name: mid, mass: 1, at: [1, 0, 0]}\n"
    "  - {name: tip, mass: 2, at: [1, 1, 0]}\n";

/// Returns the scene of the three points and one more line of text, on line 5.
inline BadScene bad_line(const std::string& name, const std::string& text,
                         std::vector<std::string> messages) {
  return {name, {{"scene.yaml", kThreePoints + text + "\n"}}, std::move(messages)};
}

/// Holds two points joined by the matrix K.mtx.
inline const std::string kMatrixScene =
    "points:\n"
    "  - {name: a, mass: 1, at: [0, 0, 0]}\n"
    "  - {name: b, mass: 1, at: [1, 0, 0]}\n"
    "links:\n"
    "  - {name: body, matrix: K.mtx, points: all}\n";

inline const std::string kMatrixHeader = "%%MatrixMarket matrix coordinate real symmetric\n";

}  // namespace freeflex::testing
