// view_fixture FOLDER writes, for some scenes, the data that the page gets, and the positions of the points
// from read_point, with which page_test.mjs compares the positions in the page.
#include <cstdio>
#include <fstream>
#include <string>

#include "core/step/readout.hpp"
#include "service/io/wire/outbound.hpp"
#include "tools/view/live.hpp"

namespace {

using namespace freeflex;

void write(const std::string& path, const std::vector<std::byte>& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

int write_scene(const std::string& name, const std::string& folder) {
  constexpr int kTicks = 1700;
  const std::optional<tools::Body> body =
      tools::make_body(std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/" + name + ".yaml");
  if (!body) return 1;
  const Plan& plan = body->plan;
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  for (int tick = 0; tick < kTicks; ++tick) step(plan, state, {}, workspace, report);
  write(folder + "/" + name + ".body", tools::bytes_of(*body));
  write(folder + "/" + name + ".state",
        tools::state_frame(*body, io::make_state_message(plan, state, io::Stamp{})));
  tools::LoadFigures figures(*body);
  for (const freeflex_msgs::loads_t& page : io::make_loads_messages(plan, state, io::Stamp{}))
    figures.take(page, 0);
  write(folder + "/" + name + ".loads", tools::loads_frame(state.tick, figures.figures()));
  tools::Json points = tools::Json::array();
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (plan.points[i].row < 0) continue;
    const PointState read = read_point(plan, state, static_cast<int>(i));
    points.push_back({{"point", i}, {"position", read.p_W}, {"displacement", read.V_B}});
  }
  std::ofstream(folder + "/" + name + ".json")
      << tools::Json{{"tick", state.tick},
                     {"time", static_cast<double>(state.tick) * plan.period},
                     {"wheels", state.wheel_momentum},
                     {"initial_attitude", make_state(plan).q_WB},
                     {"name", plan.name},
                     {"size", plan.points.size()},
                     {"points", points}};
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  for (const char* name : {"satellite", "truss104", "boom", "rotor"})
    if (write_scene(name, argv[1]) != 0) return 1;
  return 0;
}
