#include "tools/campaign/shard.hpp"

#include "service/io/scene/text.hpp"

namespace freeflex::campaign {
namespace {

using io::reader::parse_integer;

constexpr std::int64_t kMost = 1'000'000'000;

}  // namespace

std::optional<Shard> parse_shard(const std::string& text,
                                 const std::function<const char*(const char*)>& variable,
                                 std::string& error) {
  const std::size_t slash = text.find('/');
  const std::string first = text.substr(0, slash);
  const auto given =
      slash == std::string::npos ? std::nullopt : parse_integer(text.substr(slash + 1), 1, kMost);
  const auto number = [&](const char* name) -> std::optional<std::int64_t> {
    const char* const value = variable(name);
    return value == nullptr ? std::nullopt : parse_integer(value, 0, kMost);
  };
  const auto refuse = [&](const std::string& why) { return error = why, std::optional<Shard>(); };
  if (slash != std::string::npos && !given)
    return refuse("the value is '" + text + "', but must be K/N, auto or auto/N, with a whole number N >= 1");
  std::optional<std::int64_t> index, count = given;
  if (first != "auto") {
    index = parse_integer(first, 0, kMost);
    if (!index || !count)
      return refuse("the value is '" + text + "', but must be K/N with K from 0 to N - 1, auto or auto/N");
  } else if (const auto task = number("SLURM_ARRAY_TASK_ID")) {
    // with N given, a task that is submitted alone keeps its number
    index = *task - (count ? 0 : number("SLURM_ARRAY_TASK_MIN").value_or(0));
    if (!count) count = number("SLURM_ARRAY_TASK_COUNT");
  } else if (const auto completion = number("JOB_COMPLETION_INDEX")) {
    index = completion;
    if (!count)
      return refuse(
          "Kubernetes tells a task its JOB_COMPLETION_INDEX, but not how many there are; write auto/N with "
          "N = completions of the job");
  } else if (const auto rank = number("OMPI_COMM_WORLD_RANK")) {
    index = rank;
    if (!count) count = number("OMPI_COMM_WORLD_SIZE");
  } else {
    return refuse(
        "auto needs one of the variables SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX and "
        "OMPI_COMM_WORLD_RANK, but none is set; write K/N");
  }
  if (!count || *index < 0 || *index >= *count)
    return refuse("K is " + std::to_string(*index) + " and N is " +
                  (count ? std::to_string(*count) : "not known") +
                  ", but K must be from 0 to N - 1; write K/N");
  return Shard{*index, *count};
}

}  // namespace freeflex::campaign
