#include "tools/campaign/shrink.hpp"

#include "service/io/scene/text.hpp"
#include "tools/campaign/opened.hpp"

namespace freeflex::campaign {
namespace {

constexpr double kNearEnough = 1e-3;  // between the factors that pass and fail

std::optional<double> value_of_text(const std::string& text) {
  return io::reader::parse_number(text, {"-"}).value;
}

}  // namespace

Shrinking::Shrinking(const Campaign& campaign, std::vector<std::string> values)
    : campaign_(campaign), values_(std::move(values)), whole_(values_) {
  open_ = remaining();
}

std::vector<std::size_t> Shrinking::remaining() const {
  std::vector<std::size_t> differ;
  for (std::size_t k = 0; k < values_.size(); ++k)
    if (values_[k] != campaign_.variables[k].nominal) differ.push_back(k);
  return differ;
}

std::optional<std::vector<std::string>> Shrinking::next() {
  // when one variable has become nominal, others may too, so all are tried again until none changes
  if (!is_scaling_ && open_.empty() && has_changed_) {
    has_changed_ = false;
    open_ = remaining();
  }
  if (!open_.empty()) {
    trial_ = values_;
    trial_[open_.back()] = campaign_.variables[open_.back()].nominal;
    return trial_;
  }
  if (!is_scaling_) {
    is_scaling_ = true;
    whole_ = values_;
    if (scaled(0.5) == whole_) high_ = low_ = 1.0;  // nothing is left that could be scaled
  }
  if (high_ - low_ <= kNearEnough) return std::nullopt;
  factor_ = 0.5 * (low_ + high_);
  trial_ = scaled(factor_);
  return trial_;
}

void Shrinking::take(bool fails) {
  ++num_trials_;
  if (is_scaling_) {
    (fails ? high_ : low_) = factor_;
  } else {
    open_.pop_back();
    has_changed_ = has_changed_ || fails;
  }
  if (fails) values_ = trial_;
}

std::vector<std::string> Shrinking::scaled(double factor) const {
  std::vector<std::string> scaled = whole_;
  for (std::size_t k = 0; k < whole_.size(); ++k) {
    if (whole_[k] == campaign_.variables[k].nominal) continue;
    const auto value = value_of_text(whole_[k]), nominal = value_of_text(campaign_.variables[k].nominal);
    const bool is_choice = std::holds_alternative<Choice>(campaign_.sampling.variables[k]);
    if (value && nominal && !is_choice)
      scaled[k] = io::reader::format_number(*nominal + factor * (*value - *nominal));
  }
  return scaled;
}

}  // namespace freeflex::campaign
