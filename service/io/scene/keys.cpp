#include "service/io/scene/keys.hpp"

#include <algorithm>
#include <utility>

#include "core/limits.hpp"
#include "core/scene/scene.hpp"
#include "core/words.hpp"

namespace freeflex::io::reader {

const Key* Section::find(std::string_view key) const {
  const auto found = std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return k.name == key; });
  return found == keys.end() ? nullptr : &*found;
}

std::vector<std::string_view> Section::names() const {
  std::vector<std::string_view> names;
  names.reserve(keys.size());
  for (const Key& key : keys) names.push_back(key.name);
  return names;
}

namespace sections {
namespace {

constexpr Quantity kNumber{"-"};
constexpr Quantity kCount{"-", Bound::kNonNegative};
constexpr Quantity kRatio{"-", Bound::kNonNegative};
constexpr Quantity kAngleStiffness{"N m/rad", Bound::kPositive};
constexpr Quantity kHorizon{"s", Bound::kPositive};
constexpr Quantity kShare{"-", Bound::kShare};
constexpr Quantity kPublicationRate{"Hz", Bound::kNonNegative};
constexpr Quantity kForce{"N"};
constexpr Quantity kTorque{"N m"};
constexpr Quantity kVelocity{"m/s"};
constexpr double kMaxInner = 2000.0;  // largest number of inner coordinates of one superelement
// [s] least max_age; longer than the 50 ms between two readings of commands in a loop with slow ticks
constexpr double kShortestAge = 0.1;

// these functions make keys of each form
Key key(std::string_view name, Form form, std::string_view about, Quantity quantity = kNumber) {
  return {.name = name, .form = form, .about = about, .quantity = quantity};
}
Key number(std::string_view name, Quantity quantity, std::string_view about, Range range = {}) {
  Key made = key(name, Form::kNumber, about, quantity);
  made.range = range;
  return made;
}
Key whole(std::string_view name, double least, double most, std::string_view about) {
  Key made = key(name, Form::kWhole, about, kCount);
  made.range = {least, most};
  return made;
}
Key numbers(std::string_view name, std::vector<std::size_t> counts, Quantity quantity,
            std::string_view about) {
  Key made = key(name, Form::kNumbers, about, quantity);
  made.counts = std::move(counts);
  return made;
}
Key vector(std::string_view name, Quantity quantity, std::string_view about) {
  return numbers(name, {3}, quantity, about);
}
Key words(std::string_view name, Form form, std::vector<std::string_view> allowed, std::string_view about) {
  Key made = key(name, form, about);
  made.words = std::move(allowed);
  return made;
}
Key mapping(std::string_view name, const Section& section, std::string_view about) {
  Key made = key(name, Form::kSection, about);
  made.sections = {&section};
  return made;
}
// the word off may stand in place of the mapping
Key or_off(Key key) {
  key.words = {"off"};
  return key;
}
Key items(std::string_view name, std::vector<const Section*> of, std::string_view about,
          std::string_view example) {
  Key made = key(name, Form::kItems, about);
  made.sections = std::move(of);
  made.example = example;
  return made;
}

// these functions add properties to a key
Key required(Key made) {
  made.is_required = true;
  return made;
}
Key per(Per names, Key made) {
  made.per = names;
  return made;
}
Key shown(Key made, std::string_view example) {
  made.example = example;
  return made;
}

Key name_or_number() {
  return key("name", Form::kName, "Name of the item; default: its number, counted from 1.");
}
Key true_or_false(std::string_view name, std::string_view about) {
  return words(name, Form::kWord, {"true", "false"}, about);
}

std::vector<std::string_view> rungs() {
  std::vector<std::string_view> names;
  names.reserve(kRungs.size() + 1);
  for (const RungTraits& rung : kRungs) names.emplace_back(rung.name);
  names.emplace_back("auto");
  return names;
}

// returns the names of all features in the order of their numbers, then "all"
std::vector<std::string_view> parts() {
  std::vector<std::string_view> names;
  names.reserve(kNumFeatures + 1);
  for (int k = 0; k < kNumFeatures; ++k) names.emplace_back(name_of(static_cast<Feature>(k)));
  names.emplace_back("all");
  return names;
}

// Returns the section with the keys of one kind of link. It has the kind's own keys, and `viscous` and
// `loss_factor` if the kind allows them.
Section link(Key kind, std::vector<Key> own, const LossRefusal& losses) {
  Section section{kind.name, {name_or_number(), required(std::move(kind))}};
  section.keys.insert(section.keys.end(), own.begin(), own.end());
  const auto add = [&](Key loss, std::string_view reason) {
    if (reason.empty())
      section.keys.push_back(std::move(loss));
    else
      section.refused.push_back({loss.name, reason});
  };
  add(number("viscous", kViscous,
             "Viscous loss: the force is stiffness times (deformation + viscous times rate of deformation); "
             "default 0."),
      losses.viscous);
  add(number("loss_factor", kLossFactor,
             "Structural damping: equivalent modal damping at each frequency; default 0."),
      losses.loss_factor);
  return section;
}

Key lumped() {
  return true_or_false(
      "lumped",
      "The mass is lumped in equal parts at the link's points instead of distributed; default false.");
}
Key mean_axial() {
  return true_or_false("mean_axial",
                       "The axial mass matrix is the mean of the distributed and the lumped one, as in "
                       "Nastran's bars; default false.");
}
Key mass_per_length() {
  return number("mass_per_length", kMassPerLength, "Mass of the link, along its axis; default 0.");
}
Key axial_rigidity() { return required(number("EA", kAxialRigidity, "Axial rigidity.")); }
Key matrix_points() {
  return required(key("points", Form::kSelection, "Points, in the order of the rows of the matrix."));
}
Key chain(std::string_view kind, std::string_view about) { return key(kind, Form::kSelection, about); }

}  // namespace

const Section kTolerance{
    "tolerance",
    {number("displacement", {"m", Bound::kPositive}, "Displacement with which the verdict compares errors."),
     number("position", {"m", Bound::kPositive},
            "With fidelity auto: allowed error of position, root mean square over the points."),
     number("attitude", {"rad", Bound::kPositive}, "With fidelity auto: allowed error of attitude."),
     number("elastic", {"-", Bound::kPositive},
            "With fidelity auto: allowed error of the elastic displacements, relative to their size."),
     number("horizon", kHorizon,
            "With fidelity auto, required: time over which the errors must stay within these limits.")}};

const Section kVerdict{
    "verdict",
    {number("horizon", kHorizon,
            "Length of a horizon. If the better plan would take more than its share, one horizon in several "
            "is judged; default 10, or 2 if not all horizons are judged."),
     number("step", {"s", Bound::kMicrosecond},
            "Longest step of the better plan; default 10 ms, or 0.03 over the lowest frequency in rad/s if "
            "that is less."),
     number("share", kShare,
            "Share of a processor that the better plan may take; if it would take more, its steps are longer "
            "or one horizon in several is judged; default 0.2.")},
    "horizon"};

const Section kIntegration{
    "integration",
    {words(
         "by", Form::kWord, {"auto", "modes", "points"},
         "What the rungs corotational and full integrate: the modes, or the points of a structure of springs "
         "and bars; default auto, whichever is cheaper."),
     number(
         "accuracy", {"-", Bound::kAccuracy},
         "If points are integrated: error of the fastest vibration after 1000 rad; default 1e-6, on the rung "
         "full 1e-8.")},
    "by"};

const Section kPoint{
    "point",
    {name_or_number(),
     required(number("mass", kMass, "Mass; 0: a massless point, which links must hold in every direction.")),
     required(vector("at", kPosition, "Rest position, scene axes.")),
     numbers(
         "inertia", {3, 6}, {"kg m^2"},
         "Inertia of a body about its centre of mass: moments Jxx, Jyy, Jzz, or entries of the matrix Jxx, "
         "Jyy, Jzz, Jxy, Jxz, Jyz."),
     vector("offset", kPosition,
            "Position of the body's centre of mass relative to the point; default [0, 0, 0]."),
     numbers("axes", {4}, kNumber,
             "Unit quaternion [w, x, y, z] from the axes of inertia and offset to scene axes; default [1, 0, "
             "0, 0].")}};

const Section kPointTable{
    "point_table",
    {required(key("csv", Form::kText,
                  "CSV file, relative to the scene, with the columns mass,x,y,z [kg, m] and optionally "
                  "name."))}};

const Section kLinkTable{
    "link_table",
    {required(key("csv", Form::kText,
                  "CSV file, relative to the scene, with the columns from,to and those of one kind of "
                  "link, and optionally name."))}};

const Section kRelease{
    "release",
    {words("from", Form::kWords, {"x", "y", "z"}, "Local axes about which the first end rotates freely."),
     words("to", Form::kWords, {"x", "y", "z"}, "Local axes about which the last end rotates freely.")}};

const std::vector<Section> kLinks{
    link(chain("spring", "Axial springs along a chain of 2 or more points."),
         {required(number("stiffness", kStiffness, "Axial stiffness."))}, kElasticLosses),
    link(chain("bar", "Bars of axial stiffness EA / length along a chain of 2 or more points."),
         {axial_rigidity(), mass_per_length(), lumped(), mean_axial()}, kElasticLosses),
    link(chain("beam",
               "Beams along a chain of 2 or more points, rigidly joined to the other beams and plates at "
               "these points."),
         {axial_rigidity(), required(number("GJ", kRigidity, "Torsional rigidity.")),
          required(number("EIy", kRigidity, "Bending rigidity about local y (deflection along z).")),
          required(number("EIz", kRigidity, "Bending rigidity about local z (deflection along y).")),
          number("GAy", kAxialRigidity,
                 "Shear rigidity k G A for deflection along local y; default: no shear deformation."),
          number("GAz", kAxialRigidity,
                 "Shear rigidity k G A for deflection along local z; default: no shear deformation."),
          vector("y_axis", kNumber, "Direction of local y in scene axes; default: chosen."),
          mapping("release", kRelease, "Rotations that are free at the ends of a single beam."),
          mass_per_length(), lumped(), mean_axial()},
         kRotationLosses),
    link(
        chain("bending", "Springs on the angle at the middle point of every 3 successive points of a chain."),
        {required(number("stiffness", kAngleStiffness, "Stiffness against a change of the angle."))},
        kElasticLosses),
    link(chain("torsion",
               "Springs on the dihedral angle about the middle two points of every 4 successive points of a "
               "chain."),
         {required(number("stiffness", kAngleStiffness, "Stiffness against a change of the angle."))},
         kElasticLosses),
    link(chain("plate", "Thin triangle of 3 points, membrane and bending."),
         {required(number("E", kModulus, "Young's modulus.")),
          required(number("nu", kPoissonRatio, "Poisson's ratio.")),
          required(number("thickness", kThickness, "Thickness.")),
          number("density", kDensity, "Mass of the plate per volume; default 0."), lumped()},
         kRotationLosses),
    link(key("matrix", Form::kText, "File with a stiffness matrix [N/m] in Matrix Market format."),
         {matrix_points(),
          key("mass", Form::kText, "File with the mass matrix [kg] of a superelement, in the same format."),
          true_or_false("rotations", "The matrices also have rows for rotations; default false."),
          whole("inner", 0.0, kMaxInner, "Rows of inner coordinates after those of the points; default 0.")},
         kElasticLosses),
    link(key("flexibility", Form::kText,
             "File with a flexibility matrix [m/N] in Matrix Market format: displacements per force, with "
             "the body supported in any statically determinate way."),
         {matrix_points()}, kElasticLosses),
    link(chain("rigid", "Keeps the distance between 2 points, or joins more points into one rigid body."), {},
         kRigidLosses),
    link(chain("dashpot", "Dashpots along a chain of 2 or more points."),
         {required(number("damping", kDampingCoefficient, "Tension per rate of elongation."))},
         kDashpotLosses)};

const Section kRayleigh{
    "rayleigh",
    {number("alpha", {"1/s", Bound::kNonNegative}, "Factor of the mass matrix; default 0."),
     number("beta", {"s", Bound::kNonNegative}, "Factor of the stiffness matrix; default 0.")}};

const Section kDamping{
    "damping",
    {number("ratio", kRatio, "Damping ratio of every elastic mode; default 0."),
     per(Per::kMode, number("modes", kRatio, "Ratios of single modes, by their numbers from 1.")),
     mapping("rayleigh", kRayleigh, "Adds alpha M + beta K.")},
    "ratio"};

const Section kAttractor{
    "attractor",
    {vector("at", kPosition, "Position of the attracting body, world axes; default [0, 0, 0]."),
     required(number(
         "mu", {"m^3/s^2", Bound::kPositive},
         "Gravitational parameter: each point has the acceleration mu / distance^2 towards the body."))},
    "mu"};

const Section kInitialPoint{
    "initial_point",
    {vector("displacement", kPosition, "Elastic displacement, body axes; default [0, 0, 0]."),
     vector("velocity", kVelocity, "Rate of the elastic displacement, body axes; default [0, 0, 0].")}};

const Section kInitialMode{"initial_mode",
                           {number("q", kPosition, "Elastic coordinate; default 0."),
                            number("q_dot", kVelocity, "Rate of the elastic coordinate; default 0.")}};

const Section kInitial{
    "initial",
    {vector("position", kPosition, "Position of the scene's origin, world axes; default [0, 0, 0]."),
     numbers("attitude", {4}, kNumber,
             "Unit quaternion [w, x, y, z] from scene axes to world axes; default [1, 0, 0, 0]."),
     vector("velocity", kVelocity, "Velocity of the centre of mass, world axes; default [0, 0, 0]."),
     vector("angular_velocity", {"rad/s"}, "Angular velocity, body axes; default [0, 0, 0]."),
     per(Per::kName, mapping("points", kInitialPoint, "Elastic motion of points.")),
     per(Per::kMode, mapping("modes", kInitialMode, "Elastic motion of modes, by their numbers from 1."))}};

const Section kWheel{
    "wheel",
    {name_or_number(),
     required(key("at", Form::kReference, "The body that contains the wheel: a point with inertia.")),
     required(vector("axis", kNumber, "Spin axis of the wheel, scene axes.")),
     number("momentum", {"N m s"}, "Momentum at the start about the wheel's axis; default 0.")}};

const Section kWrench{"wrench",
                      {vector("force", kForce, "Force at the group's centre of mass; default [0, 0, 0]."),
                       vector("torque", kTorque, "Torque on the group; default [0, 0, 0].")},
                      {},
                      {"force", "torque"}};

const Section kPulse{
    "pulse",
    {number("start", {"s", Bound::kNonNegative}, "Time at which the pulse begins; default 0."),
     required(number("duration", {"s", Bound::kPositive}, "Duration of the pulse."))},
    "duration"};

const Section kSine{"sine",
                    {required(number("frequency", {"Hz", Bound::kPositive}, "Frequency of the sine.")),
                     number("phase", {"rad"}, "Phase of the sine at the start; default 0.")},
                    "frequency"};

const Section kTable{
    "table",
    {required(numbers("times", {}, {"s"}, "Times of the rows, in increasing order.")),
     required(numbers("values", {}, kNumber, "Strength at these times, interpolated linearly."))}};

const Section kLoad{
    "load",
    {name_or_number(),
     words("axes", Form::kWord, {"world", "body", "local"},
           "Axes of the forces and torques; local: the axes of the body, rotated by the elastic rotation at "
           "the point; default world."),
     per(Per::kName, vector("forces", kForce, "Forces on points.")),
     per(Per::kName, mapping("wrenches", kWrench, "Wrenches on groups, distributed over their points.")),
     per(Per::kName, vector("torques", kTorque, "Torques on bodies: points with inertia or offset.")),
     per(Per::kName, number("wheels", kTorque, "Torques of the motors of wheels.")),
     mapping("pulse", kPulse, "Full strength from start for a duration, zero at other times."),
     mapping("sine", kSine, "Strength sin(2 pi frequency t + phase)."),
     mapping("table", kTable,
             "Strength interpolated linearly between rows; before the first and after the last row it is "
             "constant.")},
    {},
    {"forces", "wrenches", "torques", "wheels"}};

const Section kFeedback{
    "feedback",
    {name_or_number(), required(key("at", Form::kReference, "Point on which the force acts.")),
     key("from", Form::kReference, "Point whose motion is measured; default: the point that at gives."),
     key("displacement", Form::kGain, "Gain of the elastic displacement, body axes.", {"N/m"}),
     key("velocity", Form::kGain, "Gain of the elastic velocity, body axes.", {"N s/m"}),
     key("acceleration", Form::kGain, "Gain of the elastic acceleration, body axes.", {"N s^2/m"})},
    {},
    {"displacement", "velocity", "acceleration"}};

const Section kLeaveOut{
    "leave_out",
    {number("tolerance", {"-", Bound::kNonNegative},
            "Largest relative contribution of the omitted small modes to the displacements; default 0.",
            {.most = 1.0, .has_most = false}),
     number("horizon", kHorizon, "Simulated time over which this contribution is estimated; default 10."),
     words("on_need", Form::kWord, {"keep", "refuse", "replan"},
           "What to do with features that only commands can need; default keep."),
     words("keep", Form::kWords, parts(), "Features that are always kept; default: none.")},
    "tolerance"};

const Section kModes{
    "modes",
    {number("below", {"Hz", Bound::kPositive},
            "All modes below this frequency are kept; a Sturm sequence verifies their number."),
     whole("count", 1.0, kMaxElastic, "Number of lowest modes that are kept, mechanisms included.")},
    "count",
    {"below", "count"}};

const Section kPublishedPoints{
    "published_points",
    {number("rate", kPublicationRate, "Rate; default 50, 0 switches it off."),
     key("of", Form::kSelection, "Points; default: all, or none if the scene has more than 1000 points.")},
    "rate"};

const Section kPublishedLoads{
    "published_loads",
    {number("rate", kPublicationRate, "Rate; default 50, 0 switches it off."),
     key("of", Form::kSelection, "Links; default: all, or none if the scene has more than 1000 points.")},
    "rate"};

namespace {

// A further channel with a list needs a section here, and its own branch in SceneReader::read_publish.
static_assert(std::ranges::count_if(kMotionChannels,
                                    [](const ChannelTraits& each) { return each.lists_items; }) == 2,
              "publish_keys and read_publish know the lists of points and loads");

std::vector<Key> publish_keys() {
  std::vector<Key> keys;
  for (std::size_t i = 0; i < kNumMotionChannels; ++i) {
    const ChannelTraits& channel = kMotionChannels[i];
    keys.push_back(
        channel.lists_items
            ? mapping(channel.key, i == kPointsChannel ? kPublishedPoints : kPublishedLoads, channel.about)
            : number(channel.key, kPublicationRate, channel.about));
  }
  keys.push_back(
      key("groups", Form::kSelection, "Groups whose poses are published with the points; default: all."));
  keys.push_back(
      number("status", kPublicationRate,
             "Rate of the status; default 10. At least 10 status messages a second are published."));
  return keys;
}

}  // namespace

const Section kPublish{"publish", publish_keys()};

const Section kCommands{
    "commands",
    {key("points", Form::kSelection,
         "Points that commands may push; default: all, or none if the scene has more than 1000 points."),
     number("force_limit", {"N", Bound::kPositive}, "Largest force on a point or wrench; default: none."),
     number("torque_limit", {"N m", Bound::kPositive},
            "Largest torque of a wrench, on a body or of a motor; default: none."),
     number("max_age", {"s", Bound::kPositive},
            "If a command waits longer than this for its decision, it is refused; default 1.",
            {.least = kShortestAge}),
     number("sender_share", {"-", Bound::kPositive},
            "Largest fraction of slots, and of waiting commands, for one sender on the bus; default 0.25.",
            {.most = 1.0}),
     number("max_hold", {"s", Bound::kPositive},
            "Longest lease or duration of a command from the bus, and longest time that it may wait for its "
            "start; default 60.")}};

namespace {

std::vector<const Section*> link_items() {
  std::vector<const Section*> of{&kLinkTable};
  for (const Section& kind : kLinks) of.push_back(&kind);
  return of;
}

}  // namespace

const Section kScene{
    "scene",
    {key("name", Form::kName, "Name of the scene; default: the file's."),
     number("rate", {"Hz", Bound::kTickRate}, "Ticks per second; default 1000."),
     words("fidelity", Form::kWord, rungs(),
           "The equations: a rung of the fidelity ladder, or auto for the cheapest rung that meets the "
           "tolerance; default separated."),
     mapping("tolerance", kTolerance,
             "The scale of the verdict and, with fidelity auto, the allowed errors."),
     mapping("integration", kIntegration, "What the rungs with true geometry integrate, and how accurately."),
     or_off(mapping("verdict", kVerdict,
                    "How the motion is judged, by its distance from the same motion on a better plan; or the "
                    "word off.")),
     required(items(
         "points", {&kPointTable, &kPoint}, "Point masses and bodies.",
         R"([{"name": "hub", "mass": 40, "at": [0, 0, 0]}, {"name": "tip", "mass": 2, "at": [3, 0, 0]}])")),
     items(
         "links", link_items(), "Links between points. One of the keys gives the kind.",
         R"([{"name": "tube", "beam": ["hub..tip"], "EA": 6.4e7, "GJ": 5.6e4, "EIy": 7.5e4, "EIz": 7.5e4}])"),
     shown(per(Per::kNewName,
               key("groups", Form::kSelection, "Sets of points that accept wrenches and have a pose.")),
           R"({"outer": ["tip"]})"),
     shown(mapping("damping", kDamping, "Damping of the elastic modes."), R"({"ratio": 0.01})"),
     shown(vector("gravity", {"m/s^2"}, "Uniform field, world axes; default [0, 0, 0]."), "[0, 0, -9.81]"),
     mapping("attractor", kAttractor, "A fixed body that attracts every point."),
     mapping("initial", kInitial, "State at the start; default: at rest at the origin."),
     items("wheels", {&kWheel}, "Wheels in bodies.", ""),
     items("loads", {&kLoad},
           "Forces and torques. Each load may have one of pulse, sine and table; without one it is "
           "constant.",
           R"([{"name": "kick", "forces": {"tip": [0, 5, 0]}, "pulse": {"start": 1, "duration": 0.1}}])"),
     items("feedback", {&kFeedback}, "Forces proportional to the motion of a point.",
           R"([{"at": "tip", "velocity": -0.5}])"),
     mapping("leave_out", kLeaveOut, "Features and modes that the plan may omit."),
     mapping("modes", kModes,
             "Elastic modes that are set up, by below or by count. Default: all, or, if the scene has more "
             "than 1235 points, the modes below half the rate, at most 300."),
     mapping("publish", kPublish, "Data that are published, and their rates."),
     mapping("commands", kCommands, "Limits of commands.")},
    {},
    {},
    {{"error_budget",
      "has become verdict, the distance from the same motion on a better plan, which is computed without "
      "this key too; remove the key, or write verdict: {horizon: S}"}}};

const Section kBasedScene{
    "scene",
    {key("name", Form::kName, "Name of the scene; default: that of the base."),
     required(key("base", Form::kText, "File of another scene, which this scene changes.")),
     key("set", Form::kSection, "Values by their paths, which are set in the base.")}};

}  // namespace sections
}  // namespace freeflex::io::reader
