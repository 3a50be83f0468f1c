// Cases that are steered by a program, which steps a daemon in lockstep over a bus of its own.
#pragma once

#include <string>

#include "service/campaign/case.hpp"

namespace freeflex::campaign {

/// Returns why this machine can run no case of a campaign with a program: there is no such program, no
/// freeflexd beside this program, or no route for the bus. Returns an empty text if there is no reason.
std::string find_program_fault(const Campaign& campaign);

/// Runs a case on freeflexd in lockstep, with the program of the campaign on the same bus, and records what
/// the daemon publishes. The bus is a UDP multicast group at a random address with a time to live of 0, so
/// its packets stay on this machine. The program runs in the folder of the campaign file. It finds the bus in
/// LCM_DEFAULT_URL; FREEFLEX_CASE, FREEFLEX_SEED and, for each parameter, FREEFLEX_PARAMETER_NAME tell it of
/// its case. \param folder  where the scene of the case and the recording are written \param log     receives
/// the path of the recording \param fault   receives what this machine lacks to run any case, or an empty
/// text \return an empty text, or why the program did not steer the case to its end
std::string run_program(const Campaign& campaign, const Case& of, const std::string& folder, std::string& log,
                        std::string& fault);

}  // namespace freeflex::campaign
