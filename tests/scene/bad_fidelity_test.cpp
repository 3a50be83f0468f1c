// The scenes in these tests are refused for their rung, the tolerance of the rung or the verdict.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

// the text under test is on line 5
class FidelityKey : public ::testing::TestWithParam<BadScene> {};

TEST_P(FidelityKey, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

const std::string kNone =
    "tolerance: no error is given; give position [m], attitude [rad] or elastic (fraction)";

INSTANTIATE_TEST_SUITE_P(
    BadScene, FidelityKey,
    ::testing::Values(
        bad_line("UnknownRung", "fidelity: best",
                 {"scene.yaml:5:11: error: scene: fidelity is the text 'best', but must be rigid, separated, "
                  "spin-loaded, coupled, corotational, full or auto"}),
        bad_line(
            "NearlyARung", "fidelity: corotationl",
            {"scene.yaml:5:11: error: scene: fidelity is the text 'corotationl', but must be rigid, "
             "separated, spin-loaded, coupled, corotational, full or auto (did you mean 'corotational'?)"}),
        bad_line(
            "FormerNameOfARung", "fidelity: exact-bars",
            {"scene.yaml:5:11: error: scene: fidelity: exact-bars has become corotational, which also has "
             "beams, plates, angle springs and rigid bodies at true geometry; write fidelity: corotational"}),
        bad_line(
            "FormerNameOfARungWithATolerance", "fidelity: exact-bars\ntolerance: {displacement: 1e-5}",
            {"scene.yaml:5:11: error: scene: fidelity: exact-bars has become corotational, which also has "
             "beams, plates, angle springs and rigid bodies at true geometry; write fidelity: "
             "corotational"}),
        bad_line(
            "AutoWithoutTolerance", "fidelity: auto",
            {"scene.yaml:5:11: error: scene: fidelity is auto without a tolerance; add tolerance: "
             "{position: [m], attitude: [rad], elastic: fraction, horizon: [s]}, with at least one of the "
             "first three"}),
        bad_line("ToleranceWithoutAuto", "tolerance: {position: 1, horizon: 2}",
                 {"scene.yaml:5:23: error: tolerance: position has no effect without fidelity: auto; set "
                  "that, or remove this key",
                  "scene.yaml:5:35: error: tolerance: horizon has no effect without fidelity: auto; set "
                  "that, or remove this key"}),
        bad_line("ToleranceOfDisplacementOutOfRange", "tolerance: {displacement: 0}",
                 {"scene.yaml:5:27: error: tolerance: displacement is 0 m, but must be > 0"}),
        bad_line("ToleranceOutOfRange", "fidelity: auto\ntolerance: {position: -1, horizon: 0}",
                 {"scene.yaml:6:23: error: tolerance: position is -1 m, but must be > 0",
                  "scene.yaml:6:36: error: tolerance: horizon is 0 s, but must be > 0"}),
        bad_line("ToleranceWithoutQuantity", "fidelity: auto\ntolerance: {horizon: 2}",
                 {"scene.yaml:6:12: error: " + kNone}),
        bad_line("ToleranceWithoutHorizon", "fidelity: auto\ntolerance: {elastic: 0.01}",
                 {"scene.yaml:6:12: error: tolerance: horizon is missing; it must be a number > 0 [s]"}),
        bad_line("ToleranceOfAnUnknownQuantity", "fidelity: auto\ntolerance: {positon: 1, horizon: 2}",
                 {"scene.yaml:6:13: error: tolerance: the key 'positon' is unknown (did you mean "
                  "'position'?); allowed are displacement, position, attitude, elastic, horizon"}),
        bad_line("VerdictIsANumber", "verdict: 3",
                 {"scene.yaml:5:10: error: verdict is the text '3', but must be off or a mapping of "
                  "horizon, step, share; leave it out to judge the motion with the defaults"}),
        bad_line(
            "VerdictIsAnotherWord", "verdict: none",
            {"scene.yaml:5:10: error: verdict is the text 'none', but must be off or a mapping of horizon, "
             "step, share; leave it out to judge the motion with the defaults"}),
        bad_line("VerdictOutOfRange", "verdict: {horizon: -3, step: 0, share: 0}",
                 {"scene.yaml:5:20: error: verdict: horizon is -3 s, but must be > 0",
                  "scene.yaml:5:30: error: verdict: step is 0 s, but must be >= 1e-6",
                  "scene.yaml:5:40: error: verdict: share is 0, but must be from 0.001 to 1"}),
        bad_line("ErrorBudgetIsTheFormerKey", "error_budget: {horizon: 3}",
                 {"scene.yaml:5:1: error: scene: error_budget has become verdict, the distance from the same "
                  "motion on a better plan, which is computed without this key too; remove the key, or write "
                  "verdict: {horizon: S}"})),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
