#include "tools/verification/reference/rivals.hpp"

#include <utility>

#include "tools/verification/reference/hand_written.hpp"
#include "tools/verification/reference/linearised.hpp"
#include "tools/verification/reference/packaged.hpp"

namespace freeflex {

std::unique_ptr<RivalMethod> make_rival(Rival rival, const CartesianSystem& system, std::string& error) {
  if (is_linearised(rival)) return Linearised::make(rival, system, error);
  std::optional<SpringNetwork> network = SpringNetwork::make(system, error);
  if (!network) return nullptr;
  if (is_by_hand(rival)) return make_hand_written(rival, std::move(*network));
  return std::make_unique<Packaged>(rival, std::move(*network));
}

}  // namespace freeflex
