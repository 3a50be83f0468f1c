// Stoermer's method for rigid bodies: a symmetric splitting of forces and free rotation, with extrapolation
// or composition   (THEORY 13.23).
#include <algorithm>

#include "tools/verification/reference/body_system.hpp"
#include "tools/verification/reference/hand_written.hpp"

namespace freeflex {
namespace {

class Splitting : public HandWritten {
 public:
  /// \param columns  of the extrapolation; 1: the splitting alone
  Splitting(int columns, BodySystem& bodies, std::unique_ptr<SecondOrderSystem> system)
      : HandWritten({columns * (columns + 1) / 2 + 1, 14, 0.0, true, true}, std::move(system)),
        bodies_(bodies) {
    for (auto* values : {&x_at_, &u_, &u_at_, &g_, &g_at_, &sum_x_, &sum_u_}) values->resize(x_.size());
    for (int j = 1; j <= columns; ++j) {
      double weight = 1.0;
      for (int i = 1; i <= columns; ++i)
        if (i != j) weight *= static_cast<double>(j * j) / static_cast<double>(j * j - i * i);
      weights_.push_back(weight);
    }
  }

 private:
  void step(double t, double h) override {
    const std::size_t n = x_.size();
    g_ = bodies_.last_kicks();
    bodies_.to_momenta(t, x_.data(), v_.data(), u_.data());
    std::fill(sum_x_.begin(), sum_x_.end(), 0.0);
    std::fill(sum_u_.begin(), sum_u_.end(), 0.0);
    for (std::size_t j = 1; j <= weights_.size(); ++j) {
      column(t, h / static_cast<double>(j), j);
      for (std::size_t i = 0; i < n; ++i) {
        sum_x_[i] += weights_[j - 1] * (x_at_[i] - x_[i]);
        sum_u_[i] += weights_[j - 1] * (u_at_[i] - u_[i]);
      }
    }
    for (std::size_t i = 0; i < n; ++i) x_[i] += sum_x_[i], u_[i] += sum_u_[i];
    bodies_.from_momenta(t + h, x_.data(), u_.data(), v_.data());
    bodies_.forces(t + h, x_.data(), v_.data(), f_.data());
  }

  void column(double t, double h_j, std::size_t count) {
    const std::size_t n = x_.size();
    x_at_ = x_;
    for (std::size_t i = 0; i < n; ++i) u_at_[i] = u_[i] + 0.5 * h_j * g_[i];
    for (std::size_t m = 1; m <= count; ++m) {
      const double end = t + static_cast<double>(m) * h_j;
      bodies_.drift(end - 0.5 * h_j, h_j, x_at_.data(), u_at_.data());
      bodies_.kicks(end, x_at_.data(), g_at_.data());
      const double part = m < count ? h_j : 0.5 * h_j;
      for (std::size_t i = 0; i < n; ++i) u_at_[i] += part * g_at_[i];
    }
  }

  BodySystem& bodies_;
  std::vector<double> weights_;
  std::vector<double> x_at_, u_, u_at_, g_, g_at_, sum_x_, sum_u_;
};

}  // namespace

std::unique_ptr<HandWritten> make_body_method(Rival rival, std::unique_ptr<BodySystem> system) {
  BodySystem& bodies = *system;
  const int columns = rival == Rival::kStoermer8    ? 4
                      : rival == Rival::kStoermer12 ? 6
                      : rival == Rival::kStoermer16 ? 8
                                                    : 1;
  return std::make_unique<Splitting>(columns, bodies, std::move(system));
}

}  // namespace freeflex
