// Reads campaign files.
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <new>

#include "service/campaign/campaign.hpp"
#include "service/io/scene/fields.hpp"
#include "service/io/scene/reader.hpp"

namespace freeflex::campaign {
namespace {

using io::reader::Bound;
using io::reader::Fields;
using io::reader::Form;
using io::reader::Key;
using io::reader::Node;
using io::reader::Report;
using io::reader::Section;

constexpr double kMostCases = 1e9;
constexpr double kMostTime = 1e9;  // [s] of a case
constexpr std::size_t kMostVariables = 1000;
constexpr std::size_t kMostMeasures = 1000;

Key key(std::string_view name, Form form, io::reader::Quantity quantity = {"-"}, bool is_required = false) {
  Key made{.name = name, .form = form, .about = {}, .quantity = quantity};
  made.is_required = is_required;
  return made;
}

const Section kCampaign{
    "campaign",
    {key("name", Form::kName), key("scene", Form::kText, {"-"}, true),
     key("cases", Form::kWhole, {"-"}, true), key("seed", Form::kWhole), key("design", Form::kWord),
     key("until", Form::kNumber, {"s", Bound::kPositive}, true),
     key("time_limit", Form::kNumber, {"s", Bound::kPositive}), key("set", Form::kSection),
     key("vary", Form::kItems), key("correlation", Form::kSection), key("commands", Form::kText),
     key("controller", Form::kSection), key("measure", Form::kItems, {"-"}, true)}};
const Section kVariable{
    "variable",
    {key("name", Form::kName), key("path", Form::kText, {"-"}, true), key("normal", Form::kSection),
     key("lognormal", Form::kSection), key("uniform", Form::kNumbers), key("list", Form::kItems),
     key("min", Form::kNumber), key("max", Form::kNumber), key("nominal", Form::kText)}};
const Section kNormalKeys{
    "normal",
    {key("mean", Form::kNumber, {"-"}, true), key("sd", Form::kNumber, {"-", Bound::kPositive}, true)}};
const Section kLogNormalKeys{"lognormal",
                             {key("median", Form::kNumber, {"-", Bound::kPositive}, true),
                              key("log_sd", Form::kNumber, {"-", Bound::kPositive}, true)}};
const Section kCorrelation{
    "correlation", {key("of", Form::kSelection, {"-"}, true), key("matrix", Form::kItems, {"-"}, true)}};
const Section kController{
    "controller",
    {key("library", Form::kText), key("python", Form::kText), key("program", Form::kText),
     key("every", Form::kNumber, {"s", Bound::kPositive}), key("parameters", Form::kSection)}};
const Section kMeasure{
    "measure",
    {key("name", Form::kName), key("of", Form::kText, {"-"}, true), key("take", Form::kWord, {"-"}, true),
     key("from", Form::kNumber, {"s", Bound::kNonNegative}),
     key("to", Form::kNumber, {"s", Bound::kPositive}), key("target", Form::kNumber),
     key("band", Form::kNumber, {"-", Bound::kPositive}), key("reference", Form::kNumbers),
     key("fail_above", Form::kNumber), key("fail_below", Form::kNumber)}};

const std::vector<std::string_view> kDesigns{"random", "latin_hypercube", "sobol"};

class CampaignReader {
 public:
  CampaignReader(Report& report, Campaign& campaign) : report_(report), campaign_(campaign) {}

  void read(const Node& root) {
    const Fields fields(report_, root, "campaign", kCampaign);
    if (!fields.is_mapping()) return;
    if (const Node* name = fields.find("name"))
      if (const auto text = read_name(report_, *name, "campaign: name")) campaign_.name = *text;
    read_file(fields, "scene", campaign_.scene);
    read_file(fields, "commands", campaign_.commands);
    const double cases = read_whole(fields, "cases", 1.0, kMostCases, 0.0);
    const double seed = read_whole(fields, "seed", 0.0, 9007199254740992.0, 1.0);
    campaign_.sampling.cases = static_cast<std::int64_t>(cases);
    campaign_.sampling.seed = static_cast<std::uint64_t>(seed);
    if (const Node* design = fields.find("design"))
      if (const auto word = read_word(report_, *design, "campaign: design", kDesigns))
        campaign_.sampling.design = static_cast<Design>(*word);
    fields.read("until", campaign_.until);
    campaign_.time_limit = 600.0;
    fields.read("time_limit", campaign_.time_limit);
    const std::string file = campaign_.path;
    if (const Node* set = fields.find("set"))
      campaign_.set = io::reader::read_settings(report_, *set, "campaign: set", file);
    if (const Node* controller = fields.find("controller")) read_controller(*controller);
    if (const Node* vary = fields.find("vary"))
      for (const Node* item : items_of(*vary, "vary", kMostVariables)) read_variable(*item);
    if (const Node* correlation = fields.find("correlation")) read_correlation(*correlation);
    if (const Node* measure = fields.require("measure", "must be a list of {name, of, take}"))
      for (const Node* item : items_of(*measure, "measure", kMostMeasures)) read_measure(*item);
    if (campaign_.measures.empty() && !report_.has_error())
      report_.error(root.origin, "campaign: measure is empty; it must list what is measured");
    check_times(root);
    std::string said;
    // with more cases, the values of the first ones stay, except in a Latin hypercube
    const bool counts_cases = campaign_.sampling.design == Design::kLatinHypercube;
    for (const auto& [name, value] : root.entries)
      if (name->text != "name" && name->text != "time_limit" && (counts_cases || name->text != "cases"))
        said += name->text + ": " + io::reader::flow_text(*value) + "\n";
    campaign_.hash = XXH3_64bits(said.data(), said.size());
  }

 private:
  std::vector<const Node*> items_of(const Node& node, const std::string& label, std::size_t most) {
    if (node.kind == Node::Kind::kMapping) return {&node};
    if (node.kind != Node::Kind::kList) {
      report_.error(node.origin, label + " is " + describe(node) + ", but must be a list");
      return {};
    }
    if (node.items.size() <= most) return {node.items.begin(), node.items.end()};
    report_.error(node.origin, label + " has " + std::to_string(node.items.size()) + " items, but at most " +
                                   std::to_string(most) + " are allowed");
    return {};
  }

  double read_whole(const Fields& fields, const char* name, double least, double most, double otherwise) {
    double value = std::numeric_limits<double>::quiet_NaN();  // stays if there is no number
    fields.read(name, value);
    const Node* const node = fields.find(name);
    if (std::isnan(value)) return otherwise;
    if (node == nullptr || !(value < least || value > most || value != std::floor(value))) return value;
    report_.error(node->origin, fields.label_of(name) + " is " + describe(*node) +
                                    ", but must be a whole number from " + io::reader::format_number(least) +
                                    " to " + io::reader::format_number(most));
    return otherwise;
  }

  void read_file(const Fields& fields, const char* name, std::string& path) {
    const Node* const node = fields.find(name);
    if (node == nullptr) return;
    if (const auto text = read_text(report_, *node, fields.label_of(name))) path = beside(*text);
  }
  std::string beside(const std::string& file) const {
    return (std::filesystem::path(campaign_.folder) / file).string();
  }

  void read_variable(const Node& node) {
    const io::reader::ItemOfReport item(report_);
    Variable variable;
    variable.origin = node.origin;
    const std::string place = std::to_string(campaign_.variables.size() + 1);
    const Fields fields(report_, node, io::reader::item_label("variable", node, place), kVariable);
    if (!fields.is_mapping()) return;
    if (const Node* path = fields.require("path", "must be the path of a value, or a list of paths"))
      for (const Node* each : path->kind == Node::Kind::kList ? path->items : std::vector<const Node*>{path})
        if (const auto text = read_text(report_, *each, fields.label_of("path")))
          read_path(*text, *each, variable);
    if (variable.paths.empty()) {
      if (!report_.has_error()) report_.error(node.origin, fields.label() + ": path is an empty list");
      return;
    }
    variable.name = variable.paths.front();
    if (const Node* name = fields.find("name"))
      if (const auto text = read_name(report_, *name, fields.label_of("name"))) variable.name = *text;
    add_name(variable.name, node);
    const auto distribution = read_distribution(fields, node);
    if (!distribution) return;
    const Choice* const choice = std::get_if<Choice>(&*distribution);
    variable.nominal =
        choice != nullptr ? choice->values.front() : io::reader::format_number(quantile(*distribution, 0.5));
    if (const Node* nominal = fields.find("nominal")) variable.nominal = io::reader::flow_text(*nominal);
    check_parameter(fields, variable, choice);
    campaign_.variables.push_back(std::move(variable));
    campaign_.sampling.variables.push_back(*distribution);
  }

  void read_path(const std::string& path, const Node& node, Variable& variable) {
    std::vector<io::reader::PathStep> steps;
    if (const std::string problem = io::reader::parse_path(path, steps); !problem.empty())
      return report_.error(node.origin, "path " + io::reader::quote(path) + ": " + problem);
    const auto refuse = [&](const std::string& why) {
      report_.error(node.origin, "path " + io::reader::quote(path) + why);
    };
    if (path.starts_with(kControllerPath)) {
      if (campaign_.controller.kind == ControllerFile::Kind::kNone)
        return refuse(" names a parameter, but the campaign has no controller; add the key controller");
      std::vector<std::string_view> names;
      for (const auto& [name, value] : campaign_.controller.parameters) names.push_back(name);
      const std::string name = path.substr(std::string_view(kControllerPath).size());
      if (std::find(names.begin(), names.end(), name) == names.end())
        return refuse(" names no parameter of the controller" + io::reader::did_you_mean(name, names) +
                      "; its parameters, with the values of all other cases, are listed under controller: "
                      "parameters");
    }
    if (!steps.back().is_multiplied) {
      const std::string other = find_overlap(steps, path, variable);
      if (!other.empty())
        return refuse(other == path
                          ? " is varied twice, but only the last value would count; remove one, or multiply "
                            "with a path that ends with *"
                          : " may set a value that " + io::reader::quote(other) +
                                " sets too, but only the last value would count; remove one, multiply with "
                                "a path that ends with *, or name both items by their names");
    }
    variable.paths.push_back(path);
  }

  // Returns a path before this one whose value it may replace, wholly or in part, or an empty text. Two paths
  // of one variable set the same value, so they may overlap.
  std::string find_overlap(const std::vector<io::reader::PathStep>& steps, const std::string& path,
                           const Variable& variable) const {
    if (std::count(variable.paths.begin(), variable.paths.end(), path) > 0) return path;
    for (const Variable& other : campaign_.variables)
      for (const std::string& earlier : other.paths) {
        std::vector<io::reader::PathStep> of_earlier;
        static_cast<void>(io::reader::parse_path(earlier, of_earlier));
        const std::size_t common = std::min(steps.size(), of_earlier.size());
        bool may_meet = true;
        for (std::size_t k = 0; k < common && may_meet; ++k) {
          const io::reader::PathStep &a = steps[k], &b = of_earlier[k];
          // a place and a name may be of the same item
          may_meet = a.text == b.text || a.is_all() || b.is_all() || a.is_place() != b.is_place();
        }
        if (may_meet) return earlier;
      }
    return {};
  }

  // the values of a parameter must be numbers
  void check_parameter(const Fields& fields, const Variable& variable, const Choice* choice) {
    if (std::none_of(variable.paths.begin(), variable.paths.end(),
                     [](const std::string& path) { return path.starts_with(kControllerPath); }))
      return;
    std::vector<std::string> texts = choice != nullptr ? choice->values : std::vector<std::string>{};
    texts.push_back(variable.nominal);
    for (const std::string& text : texts)
      if (!io::reader::parse_number(text, {"-"}).value)
        return report_.error(fields.origin(), fields.label() + " has the value " + io::reader::quote(text) +
                                                  ", but a parameter of the controller must be a number");
  }

  std::optional<Distribution> read_distribution(const Fields& fields, const Node& node) {
    int num_kinds = 0;
    std::optional<Distribution> read;
    Truncation truncation;
    fields.read("min", truncation.min);
    fields.read("max", truncation.max);
    if (const Node* normal = fields.find("normal"); normal != nullptr && ++num_kinds) {
      const Fields keys(report_, *normal, fields.label_of("normal"), kNormalKeys);
      Normal made{.truncation = truncation};
      keys.read("mean", made.mean);
      keys.read("sd", made.sd);
      read = made;
    }
    if (const Node* lognormal = fields.find("lognormal"); lognormal != nullptr && ++num_kinds) {
      const Fields keys(report_, *lognormal, fields.label_of("lognormal"), kLogNormalKeys);
      LogNormal made{.truncation = truncation};
      keys.read("median", made.median);
      keys.read("log_sd", made.log_sd);
      read = made;
    }
    if (const Node* uniform = fields.find("uniform"); uniform != nullptr && ++num_kinds)
      if (const auto ends = read_numbers(report_, *uniform, fields.label_of("uniform"), {"-"}, 2))
        read = Uniform{(*ends)[0], (*ends)[1]};
    if (const Node* list = fields.find("list"); list != nullptr && ++num_kinds)
      read = read_choice(fields, *list);
    if (num_kinds != 1) {
      report_.error(node.origin, fields.label() + " has " + (num_kinds == 0 ? "no" : "more than one") +
                                     " distribution; it must have one of normal, lognormal, uniform, list");
      return std::nullopt;
    }
    if (!read || report_.has_error()) return std::nullopt;
    const bool is_truncated = fields.find("min") != nullptr || fields.find("max") != nullptr;
    if (is_truncated && !std::holds_alternative<Normal>(*read) && !std::holds_alternative<LogNormal>(*read))
      report_.error(node.origin, fields.label() + " has min or max, which only normal and lognormal take");
    if (const std::string fault = find_fault(*read); !fault.empty()) {
      report_.error(node.origin, fields.label() + ": " + fault);
      return std::nullopt;
    }
    return read;
  }

  std::optional<Distribution> read_choice(const Fields& fields, const Node& list) {
    Choice choice;
    for (const Node* each : items_of(list, fields.label_of("list"), io::reader::kMaxYamlNodes))
      choice.values.push_back(io::reader::flow_text(*each));
    if (!choice.values.empty()) return choice;
    if (!report_.has_error()) report_.error(list.origin, fields.label_of("list") + " is empty");
    return std::nullopt;
  }

  void read_correlation(const Node& node) {
    const Fields fields(report_, node, "correlation", kCorrelation);
    const Node* const of = fields.require("of", "must be a list of names of variables");
    const Node* const matrix = fields.require("matrix", "must be a list of rows");
    if (of == nullptr || matrix == nullptr || report_.has_error()) return;
    std::vector<std::size_t> chosen;
    for (const Node* each : items_of(*of, "correlation: of", kMostVariables)) {
      const auto variable = std::find_if(campaign_.variables.begin(), campaign_.variables.end(),
                                         [&](const Variable& v) { return v.name == each->text; });
      const auto place = static_cast<std::size_t>(variable - campaign_.variables.begin());
      if (variable == campaign_.variables.end() || std::count(chosen.begin(), chosen.end(), place) > 0)
        return report_.error(
            each->origin,
            "correlation: of names " + io::reader::quote(each->text) +
                (variable == campaign_.variables.end() ? ", which is the name of no variable" : " twice"));
      chosen.push_back(place);
    }
    const std::size_t n = campaign_.variables.size(), m = chosen.size();
    campaign_.sampling.correlation.assign(n * n, 0.0);
    for (std::size_t k = 0; k < n; ++k) campaign_.sampling.correlation[k * n + k] = 1.0;
    if (matrix->items.size() != m)
      return report_.error(matrix->origin, "correlation: matrix has " + std::to_string(matrix->items.size()) +
                                               " rows, but must have " + std::to_string(m) +
                                               ", one for each variable in of");
    for (std::size_t row = 0; row < m; ++row) {
      const auto values =
          read_numbers(report_, *matrix->items[row], "correlation: row " + std::to_string(row + 1), {"-"}, m);
      if (!values) return;
      for (std::size_t column = 0; column < m; ++column)
        campaign_.sampling.correlation[chosen[row] * n + chosen[column]] = (*values)[column];
    }
    if (const std::string fault = find_fault(campaign_.sampling); !fault.empty())
      report_.error(matrix->origin, "correlation: " + fault);
  }

  void read_controller(const Node& node) {
    using Kind = ControllerFile::Kind;
    const Fields fields(report_, node, "controller", kController);
    ControllerFile& controller = campaign_.controller;
    int num_kinds = 0;
    for (const auto& [name, kind] : {std::pair("library", Kind::kLibrary), std::pair("python", Kind::kPython),
                                     std::pair("program", Kind::kProgram)}) {
      const Node* const file = fields.find(name);
      if (file == nullptr) continue;
      ++num_kinds;
      controller.kind = kind;
      controller.files.clear();
      const bool is_list = kind == Kind::kProgram && file->kind == Node::Kind::kList;
      for (const Node* word : is_list ? file->items : std::vector<const Node*>{file})
        if (const auto text = read_text(report_, *word, fields.label_of(name)))
          controller.files.push_back(*text);
      // the first word of a program without a slash is searched for in PATH
      if (!controller.files.empty() &&
          (kind != Kind::kProgram || controller.files[0].find('/') != std::string::npos))
        controller.files[0] = beside(controller.files[0]);
    }
    if (num_kinds != 1 && fields.is_mapping())
      report_.error(node.origin, "controller must have one of library, python, program");
    fields.read("every", controller.every);
    if (controller.kind == Kind::kProgram && fields.find("every") != nullptr)
      report_.error(fields.find("every")->origin,
                    "controller: every is not for a program, which steps the daemon itself; remove it");
    if (!campaign_.commands.empty())
      report_.error(node.origin, "a campaign has either a controller or commands of a recording; remove one");
    const Node* const parameters = fields.find("parameters");
    if (parameters == nullptr) return;
    if (parameters->kind != Node::Kind::kMapping)
      return report_.error(parameters->origin, "controller: parameters is " + describe(*parameters) +
                                                   ", but must be a mapping of names to numbers");
    for (const auto& [name, value] : parameters->entries)
      if (const auto number = read_number(report_, *value, "controller: parameters: " + name->text, {"-"}))
        controller.parameters.emplace_back(name->text, *number);
  }

  void read_measure(const Node& node) {
    const io::reader::ItemOfReport item(report_);
    const std::string place = std::to_string(campaign_.measures.size() + 1);
    const Fields fields(report_, node, io::reader::item_label("measure", node, place), kMeasure);
    if (!fields.is_mapping()) return;
    Measure measure;
    measure.origin = node.origin;
    if (const Node* of = fields.require("of", "must name a quantity, such as point.tip.x"))
      if (const auto text = read_text(report_, *of, fields.label_of("of"))) measure.quantity = *text;
    const std::vector<std::string_view> words(kStatistics.begin(), kStatistics.end());
    if (const Node* take = fields.require("take", "must be one of " + io::reader::join(words)))
      if (const auto word = read_word(report_, *take, fields.label_of("take"), words))
        measure.statistic = static_cast<Statistic>(*word);
    measure.name = measure.quantity + "." + kStatistics[static_cast<std::size_t>(measure.statistic)];
    if (const Node* name = fields.find("name"))
      if (const auto text = read_name(report_, *name, fields.label_of("name"))) measure.name = *text;
    add_name(measure.name, node);
    fields.read("from", measure.from);
    fields.read("to", measure.to);
    fields.read("target", measure.target);
    fields.read("band", measure.band);
    read_limit(fields, "fail_above", measure.fail_above);
    read_limit(fields, "fail_below", measure.fail_below);
    if (const Node* reference = fields.find("reference"))
      if (const auto q = read_unit_quaternion(report_, *reference, fields.label_of("reference")))
        measure.reference = {q->w(), q->x(), q->y(), q->z()};
    check_use(fields, measure);
    campaign_.measures.push_back(std::move(measure));
  }

  void read_limit(const Fields& fields, const char* name, std::optional<double>& limit) {
    if (fields.find(name) == nullptr) return;
    double value = 0.0;
    fields.read(name, value);
    limit = value;
  }

  // reports keys that have no effect on a measure, and keys that it lacks
  void check_use(const Fields& fields, const Measure& measure) {
    const bool is_settling = measure.statistic == Statistic::kSettlingTime;
    const bool has_target = is_settling || measure.statistic == Statistic::kOvershoot;
    const auto refuse = [&](const char* name, const char* why) {
      if (const Node* node = fields.find(name))
        report_.error(node->origin, fields.label_of(name) + " has no effect, because it is only for " + why);
    };
    if (!has_target) refuse("target", "settling_time and overshoot");
    if (!is_settling) refuse("band", "settling_time");
    if (measure.quantity != "attitude") refuse("reference", "the quantity attitude");
    if (is_settling && fields.find("band") == nullptr)
      report_.error(fields.origin(), fields.label() +
                                         ": band is missing; it must be the largest distance from the target "
                                         "at which the quantity counts as settled");
    if (!(measure.from < measure.to))
      report_.error(fields.origin(), fields.label() + ": from must be before to");
    if (measure.fail_above && measure.fail_below && *measure.fail_above < *measure.fail_below)
      report_.error(fields.origin(),
                    fields.label() + ": every value fails, because fail_above is below fail_below");
  }

  // columns of the table must have different names
  void add_name(const std::string& name, const Node& node) {
    if (std::find(names_.begin(), names_.end(), name) != names_.end())
      report_.error(node.origin, "two variables or measures are called " + io::reader::quote(name) +
                                     "; give one of them another name");
    // names of datasets in HDF5
    if (name == "." || name == ".." || name.find('/') != std::string::npos)
      report_.error(node.origin, "the name " + io::reader::quote(name) +
                                     " cannot be that of a column; give it a name without a slash");
    names_.push_back(name);
  }

  void check_times(const Node& root) {
    const double until = campaign_.until;
    if (until > kMostTime)
      report_.error(root.origin, "campaign: until is " + io::reader::format_number(until) +
                                     " s, but may be at most " + io::reader::format_number(kMostTime) + " s");
    for (const Measure& measure : campaign_.measures) {
      const bool has_end = std::isfinite(measure.to);
      if (until > 0.0 && (measure.from > until || (has_end && measure.to > until)))
        report_.error(measure.origin,
                      "measure " + io::reader::quote(measure.name) +
                          (measure.from > until ? " begins at " + io::reader::format_number(measure.from)
                                                : " ends at " + io::reader::format_number(measure.to)) +
                          " s, after the end of the cases; set a later until");
    }
    if (report_.has_error() || !campaign_.sampling.correlation.empty()) return;
    if (const std::string fault = find_fault(campaign_.sampling); !fault.empty())
      report_.error(root.origin, "campaign: " + fault);
  }

  Report& report_;
  Campaign& campaign_;
  std::vector<std::string> names_{"case", "outcome", "message"};
};

}  // namespace

std::string find_ticks(const ControllerFile& controller, double period, int& ticks) {
  const double wanted = controller.every / period;
  constexpr double kMost = 1e9;
  ticks = static_cast<int>(std::clamp(std::round(wanted), 1.0, kMost));
  if (controller.every == 0.0 || std::abs(static_cast<double>(ticks) - wanted) <= 0.01 * wanted) return {};
  return "controller: every is " + io::reader::format_number(controller.every) + " s, which is " +
         io::reader::format_number(wanted) + " ticks, but must be within 1 % of a whole number of ticks";
}

CampaignResult read_campaign(const std::string& path) {
  CampaignResult result;
  Report report;
  Campaign campaign;
  campaign.path = path;
  campaign.folder = std::filesystem::path(path).parent_path().string();
  campaign.name = std::filesystem::path(path).stem().string();
  io::reader::YamlTree tree;
  if (const auto source = report.open(path, {}))
    if (const Node* root = tree.parse(report, *source)) CampaignReader(report, campaign).read(*root);
  result.sources = report.sources();
  if (!report.has_error()) result.campaign = std::move(campaign);
  result.faults = report.take_faults();
  return result;
}

}  // namespace freeflex::campaign
