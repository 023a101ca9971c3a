#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace groundray {

/// Priority queue of numbers by cost, cheapest first; of equal costs the lowest number. A 4-ary
/// heap that knows the position of every number.
class CollapseQueue {
 public:
  /// @param count  of numbers: 0 to count - 1. The queue is empty at first.
  explicit CollapseQueue(std::size_t count) : places_(count, nowhere) {}

  bool empty() const noexcept { return heap_.empty(); }
  std::size_t size() const noexcept { return heap_.size(); }
  std::uint32_t top() const noexcept { return heap_.front().number; }
  double top_cost() const noexcept { return heap_.front().cost; }

  /// Inserts a number, or changes its cost.
  void set(std::uint32_t number, double cost) {
    std::uint32_t place = places_[number];
    if (place == nowhere) {
      place = static_cast<std::uint32_t>(heap_.size());
      heap_.push_back({cost, number});
    }
    sift({cost, number}, place);
  }

  /// Removes a number if it is in the queue.
  void remove(std::uint32_t number) {
    const std::uint32_t place = places_[number];
    if (place == nowhere) return;
    places_[number] = nowhere;
    const Entry last = heap_.back();
    heap_.pop_back();
    if (place < heap_.size()) sift(last, place);
  }

 private:
  static constexpr std::uint32_t nowhere = std::numeric_limits<std::uint32_t>::max();

  struct Entry {
    double cost = 0;
    std::uint32_t number = 0;
    bool operator<(const Entry& other) const noexcept {
      return cost != other.cost ? cost < other.cost : number < other.number;
    }
  };

  void put(const Entry& entry, std::size_t place) noexcept {
    heap_[place] = entry;
    places_[entry.number] = static_cast<std::uint32_t>(place);
  }

  // Moves an entry up or down from a position to where it belongs.
  void sift(const Entry& entry, std::size_t place) noexcept {
    while (place > 0 && entry < heap_[(place - 1) / 4]) {
      put(heap_[(place - 1) / 4], place);
      place = (place - 1) / 4;
    }
    while (4 * place + 1 < heap_.size()) {
      const std::size_t begin = 4 * place + 1, end = std::min(begin + 4, heap_.size());
      std::size_t least = begin;
      for (std::size_t i = begin + 1; i < end; ++i) {
        if (heap_[i] < heap_[least]) least = i;
      }
      if (!(heap_[least] < entry)) break;
      put(heap_[least], place);
      place = least;
    }
    put(entry, place);
  }

  std::vector<Entry> heap_;
  std::vector<std::uint32_t> places_;  // of each number, in the heap
};

}  // namespace groundray
