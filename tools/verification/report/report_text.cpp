// Prints the report on a terminal, and draws its conclusions.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tools/verification/report/report.hpp"

namespace freeflex::tools {
namespace {

std::string number(const std::optional<double>& value, const char* format = "%.1e") {
  if (!value || !std::isfinite(*value)) return "-";
  return format_text(format, *value);
}

/// Returns the method and the setting of a run, which fill the first kRunWidth columns of the line of the
/// run.
std::string name_of(const Run& run) {
  return format_text("  %-17s %-19s ", run.method.c_str(), setting_of(run).c_str());
}
constexpr std::size_t kRunWidth = 40;

void print_errors(const Study& study) {
  std::printf("  %-17s %-19s %7s %7s %7s %7s %7s %7s %7s %7s %7s %7s\n", "method", "setting", "elastic",
              "integr.", "model", "pos. m", "att.rad", "freq.", "energy", "once", "10 ms", "1 ms");
  for (const Run& run : study.runs) {
    std::printf("%s", name_of(run).c_str());
    if (!run.failure.empty()) {
      std::printf("%s\n", wrapped(run.failure, kRunWidth).c_str());
      continue;
    }
    std::printf("%7s %7s %7s %7s %7s %7s %7s", number(run.elastic_error).c_str(),
                number(run.integration_error).c_str(), number(run.model_error).c_str(),
                number(run.position_error).c_str(), number(run.attitude_error).c_str(),
                number(run.frequency_error).c_str(), number(run.energy_drift).c_str());
    for (const auto& cpu : run.cpu) std::printf(" %7s", number(cpu).c_str());
    std::printf("\n");
  }
}

void print_costs(const Study& study) {
  std::printf("\n  %-17s %-19s %10s %9s %10s %10s\n", "method", "setting", "steps", "ns/step", "set-up s",
              "kB");
  for (const Run& run : study.runs)
    if (run.failure.empty())
      std::printf("%s%10ld %9s %10s %10zu\n", name_of(run).c_str(), run.steps,
                  number(ns_per_step(study, run), "%.0f").c_str(), format_text("%.1g", run.set_up).c_str(),
                  run.memory / 1024);
}

std::string other(const Comparison::Other& other) {
  return other.method.empty() ? "none" : format_text("%s x%.3g", other.method.c_str(), other.ratio);
}

void print_comparisons(const Study& study) {
  std::printf("\n  %-8s %-22s %-32s %8s %8s   and below it the cost of others\n", "level", "read-out",
              "cheapest of ours", "elastic", "CPU s/s");
  for (const double level : kLevels)
    for (std::size_t load = 0; load < kReadOuts; ++load) {
      const auto found = compare_at(study, level, static_cast<ReadOut>(load));
      if (!found) {
        if (load == 0) std::printf("  %-8.0e no rung reaches it\n", level);
        continue;
      }
      const Run& ours = study.runs[found->ours];
      std::printf("  %-8.0e %-22s %-32s %8.1e %8.1e\n", level, kReadOutNames[load],
                  (ours.method + ", " + setting_of(ours)).c_str(), ours.elastic_error, found->cpu);
      const std::string others = "by hand " + other(found->hand_written) + "; packaged " +
                                 other(found->packaged) + "; linearised " + other(found->linearised);
      std::printf("           %s\n", wrapped(others, 11).c_str());
    }
}

/// The comparison with the smallest ratio of the cost of another method to our cost.
struct Nearest {
  const Study* study = nullptr;
  Comparison found;
};

Nearest nearest(const Report& report, ReadOut read_out) {
  Nearest nearest;
  for (const Study& study : report.studies)
    for (const double level : kLevels) {
      const auto found = compare_at(study, level, read_out);
      if (!found || found->best.method.empty()) continue;
      if (nearest.study != nullptr && nearest.found.best.ratio <= found->best.ratio) continue;
      nearest = {&study, *found};
    }
  return nearest;
}

/// Returns, for each read-out and each level, the smallest ratio of the cost of the best other method to our
/// cost, over all scenes.
std::string least_ratios(const Report& report) {
  std::string text;
  for (std::size_t load = 0; load < kReadOuts; ++load) {
    std::string levels;
    for (const double level : kLevels) {
      std::optional<double> least;
      for (const Study& study : report.studies)
        if (const auto found = compare_at(study, level, static_cast<ReadOut>(load));
            found && !found->best.method.empty())
          least = least ? std::min(*least, found->best.ratio) : found->best.ratio;
      if (least) levels += format_text("%s%.2g at %.0e", levels.empty() ? "" : ", ", *least, level);
    }
    if (!levels.empty())
      text += format_text("%s%s: ", text.empty() ? "" : "; ", kReadOutNames[load]) + levels;
  }
  return text;
}

/// Returns true if, on at least one scene at one level, Krylov's method is the cheapest other method with the
/// first read-out.
bool is_krylov_nearest(const Report& report) {
  for (const Study& study : report.studies)
    for (const double level : kLevels)
      if (const auto found = compare_at(study, level, ReadOut::kOnce);
          found && found->best.method == "Krylov, linear")
        return true;
  return false;
}

}  // namespace

double ns_per_step(const Study& study, const Run& run) {
  if (!run.cpu[0] || run.steps == 0) return NAN;
  return 1e9 * *run.cpu[0] * study.end / static_cast<double>(run.steps);
}

std::string forces_note(const Study& study) {
  if (!(study.evaluation_cpu > 0.0)) return {};
  const double us = 1e6 * study.evaluation_cpu;
  return format_text(
      "%s: the other methods evaluate the forces of the reference at true geometry, and one evaluation takes "
      "%.2g us. Faster code for the forces would make these methods cheaper, so their costs, and the ratios "
      "of their costs to ours, are upper bounds. A method with the ratio r would cost as much as freeflex if "
      "one evaluation took %.2g us / r.",
      study.scene.c_str(), us, us);
}

std::vector<std::string> findings(const Report& report) {
  if (report.is_interrupted) return {"Interrupted: the measurements are incomplete and allow no comparison."};
  std::vector<std::string> sentences;
  bool is_compared = false;
  for (std::size_t load = 0; load < kReadOuts; ++load) {
    const Nearest now = nearest(report, static_cast<ReadOut>(load));
    if (now.study == nullptr) continue;
    is_compared = true;
    const Run& ours = now.study->runs[now.found.ours];
    const char* scene = now.study->scene.c_str();
    const char* method = now.found.best.method.c_str();
    const double ratio = now.found.best.ratio;
    if (ratio < 1.0) {
      sentences.push_back(format_text(
          "We lose. With %s, on %s at an elastic error of %.1e, %s is %.3g times cheaper than our cheapest "
          "rung (%s).",
          kReadOutNames[load], scene, now.found.error, method, 1.0 / ratio, ours.method.c_str()));
    } else {
      sentences.push_back(format_text(
          "With %s, the nearest other method is %s on %s: it costs %.3g times our rung '%s' at the "
          "same elastic error of %.1e.",
          kReadOutNames[load], method, scene, ratio, ours.method.c_str(), now.found.error));
    }
  }
  if (is_compared)
    sentences.push_back(
        "Cost of the best other method relative to ours, by level, for the scene where it is smallest "
        "(below 1, we lose): " +
        least_ratios(report) + ".");
  for (const Study& study : report.studies)
    if (const std::string note = forces_note(study); !note.empty()) sentences.push_back(note);
  sentences.push_back(
      "One reading of the positions and velocities of N points through all modes costs about 18 N^2 "
      "products. "
      "If all points of a structure of "
      "springs are read often, integrate them in place of the modes (integration: {by: points}).");
  if (is_krylov_nearest(report))
    sentences.push_back(
        "At the errors of the separated and spin-loaded rungs Krylov's method on the linearised system "
        "comes nearest with one read-out. With one step over the whole motion its space contains every "
        "mode, so it is a modal method that computes its modes anew in each run. It is worth its cost for "
        "structures with few frequencies. It has no counterpart of the rungs above spin-loaded.");
  sentences.push_back(
      "Set-up is not in the CPU columns. A rung needs the modes first, which cost N^3 and are shown "
      "separately. For one short run of a small structure, a method without set-up can finish sooner.");
  return sentences;
}

void print_text(const Report& report) {
  const Machine& machine = report.machine;
  std::printf("%s\n", wrapped(format_text("%s, %d cores; %s %s; commit %s; %s", machine.processor.c_str(),
                                          machine.cores, machine.compiler.c_str(), machine.flags.c_str(),
                                          machine.commit.c_str(), machine.date.c_str()),
                              0)
                          .c_str());
  if (!report.studies.empty())
    std::printf(
        "errors at the end against the full system; CPU in seconds per simulated second, by read-out: once, "
        "each 10 ms, 1 ms\n");
  for (const Study& study : report.studies) {
    const std::string head = format_text(
        "%s: %zu points, %zu links, %zu elastic freedoms, %.4g to %.4g rad/s, spin %g rad/s, %g s",
        study.scene.c_str(), study.points, study.links, study.elastic_freedoms, study.lowest_frequency,
        study.top_frequency, study.spin, study.end);
    std::printf("\n%s\n", wrapped(head, 0).c_str());
    std::printf("  reference: %s, elastic error at most %.0e, %.1f s of CPU time\n", study.reference.c_str(),
                study.reference_accuracy, study.reference_cpu);
    if (!forces_note(study).empty()) std::printf("  %s\n", wrapped(forces_note(study), 2).c_str());
    print_errors(study);
    for (const LeftOut& item : study.left_out)
      std::printf("  %s\n", wrapped("left out: " + item.what + ": " + item.why, 2).c_str());
    print_costs(study);
    print_comparisons(study);
  }
  std::printf("\n");
  if (!report.studies.empty())
    for (const std::string& sentence : findings(report)) std::printf("%s\n", wrapped(sentence, 0).c_str());
  if (!report.estimates.empty()) print_estimates(report);
  if (!report.ticks.empty()) print_ticks(report);
  if (!report.omissions.empty()) print_omissions(report);
  if (report.is_interrupted) std::printf("\ninterrupted: the results are incomplete\n");
}

}  // namespace freeflex::tools
