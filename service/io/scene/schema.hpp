// The schema with which editors complete and check scenes.
#pragma once

#include <string>

namespace freeflex::io {

/// Returns the JSON Schema (draft 07) of scenes, generated from the table of keys. It accepts every scene
/// that read_scene accepts. It does not check files, references and physics.
std::string scene_schema();

}  // namespace freeflex::io
