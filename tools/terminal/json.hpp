// JSON of the tools, with keys in the order of insertion. The templates are instantiated only once, because
// instantiating them takes seconds in every file that builds a value.
#pragma once

#include <nlohmann/json.hpp>

extern template class nlohmann::basic_json<nlohmann::ordered_map>;
