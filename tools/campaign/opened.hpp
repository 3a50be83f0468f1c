// A campaign that was read and checked, and the folder of its results.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "service/campaign/campaign.hpp"

namespace freeflex::campaign {

/// The size and the time of the last change of a file.
using FileState = std::array<std::int64_t, 3>;

struct Opened {
  Campaign campaign;
  std::string stamp;   // first line of the files of results; depends on all files
  std::string folder;  // of the results
  std::vector<std::string> files;
  std::vector<FileState> states;  // of the files when the stamp was made
};

/// Whether the campaign is tried on its scene with nominal values, which needs the set-up of a plan.
enum class Check { kFile, kScene };
/// Reads a campaign. Prints the faults, and returns nullopt if one of them is an error.
/// \param out  folder of the results; empty: the campaign file with the ending .results in place of .yaml
std::optional<Opened> open_campaign(const std::string& path, const std::string& out,
                                    Check check = Check::kFile);

/// Returns which file has changed since the campaign was opened, or an empty text.
std::string find_change(const Opened& opened);

/// Returns a text as a word of the shell, in quotes if it must be.
std::string shell_word(const std::string& text);
/// Returns FILE, and --out FOLDER if it is not the default, as words of the shell.
std::string words_of_campaign(const Opened& opened);

/// Returns the texts of the nominal values.
std::vector<std::string> nominal_values(const Campaign& campaign);

/// Returns the program and arguments of a worker process for the campaign.
std::vector<std::string> worker_command(const Campaign& campaign);

}  // namespace freeflex::campaign
