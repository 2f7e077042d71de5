// Which errors are usual around a place.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace fanstream {

// The largest errors found so far in this and the last generation, by region of a few dozen patches.
class UsualErrors {
 public:
  void begin_generation() {
    now_.swap(last_);
    last_size_ = size_;
    size_ = count_ > 0 ? kPatches * static_cast<float>(sum_ / count_) : size_;
    now_.assign(std::size_t{1} << kBits, 0.0F);
    last_.resize(std::size_t{1} << kBits);
    sum_ = 0.0;
    count_ = 0;
  }
  float value(const glm::vec3& place) const {
    return std::max(now_[slot(place, size_)], last_[slot(place, last_size_)]);
  }
  void raise(const glm::vec3& place, float error, float extent) {
    float& value = now_[slot(place, size_)];
    value = std::max(value, error);
    sum_ += extent;
    ++count_;
  }

 private:
  static constexpr int kBits = 14;
  static constexpr float kPatches = 6.0F;
  // Regions that share a slot share their errors.
  static std::size_t slot(const glm::vec3& place, float size) {
    const auto whole = [&](float v) { return static_cast<std::uint32_t>(static_cast<std::int32_t>(v / size)); };
    const std::uint32_t hash =
        whole(place.x) * 0x9E3779B1U ^ whole(place.y) * 0x85EBCA77U ^ whole(place.z) * 0xC2B2AE3DU;
    return (hash ^ hash >> 15U) & ((1U << kBits) - 1U);
  }

  std::vector<float> now_, last_;
  float size_ = 1000.0F;  // edge of a region
  float last_size_ = 1000.0F;
  double sum_ = 0.0;
  std::uint32_t count_ = 0;
};

}  // namespace fanstream
