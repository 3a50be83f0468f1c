// JSON of the tools, with keys in the order of insertion. The templates are instantiated in one file only,
// because every file that instantiates them takes seconds longer to compile.
#pragma once

#include <nlohmann/json.hpp>

extern template class nlohmann::basic_json<nlohmann::ordered_map>;
