// The schema with which editors complete and check scenes.
#pragma once

#include <string>

namespace freeflex::io {

/// Returns the JSON Schema (draft 07) of scenes, generated from the table of keys. The schema accepts every
/// scene that read_scene accepts. The schema does not check files, references and physics.
std::string scene_schema();

}  // namespace freeflex::io
