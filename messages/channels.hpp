// The name of a channel is a prefix followed by a suffix. The default prefix is "FREEFLEX".
#pragma once

namespace freeflex::channels {

inline constexpr const char* kDefaultPrefix = "FREEFLEX";
inline constexpr const char* kForce = "_FORCE";
inline constexpr const char* kControl = "_CONTROL";
inline constexpr const char* kAck = "_ACK";
inline constexpr const char* kApplied = "_APPLIED";
inline constexpr const char* kState = "_STATE";
inline constexpr const char* kPoints = "_POINTS";
inline constexpr const char* kLoads = "_LOADS";
inline constexpr const char* kStatus = "_STATUS";
inline constexpr const char* kScene = "_SCENE";
inline constexpr const char* kShapes = "_SHAPES";

inline constexpr int kMaxMessageBytes = 60000;

}  // namespace freeflex::channels
