#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {

/// Vertex and its neighbourhood, counter-clockwise as seen from outside.
struct Star {
  std::uint32_t centre = 0;
  std::vector<std::uint32_t> ring;  ///< neighbours
  std::vector<HalfEdge> spokes;  ///< half-edges from the centre to ring[i]; triangle i of the star
                                 ///< is centre, ring[i], ring[i + 1]

  /// Returns true if the vertex is on the boundary. Then the ring has one vertex more than there
  /// are triangles; otherwise the last triangle ends where the first begins.
  bool is_open() const noexcept { return ring.size() > spokes.size(); }
  std::uint32_t triangle(std::size_t i) const noexcept { return spokes[i] / 3; }
};

/// Fan of triangles that replaces a star when its centre moves onto ring[to]. Its outer edges are
/// consecutive edges of the ring; triangles are numbered from the first of them on.
struct Fan {
  std::size_t first = 0;      ///< triangle of the star that becomes the first of the fan
  std::size_t triangles = 0;  ///< number of triangles that remain

  Fan() = default;
  Fan(const Star& star, std::size_t to) noexcept {
    const std::size_t count = star.spokes.size();
    first = star.is_open() ? (to == 0 ? 1 : 0) : (to + 1) % count;
    triangles = star.is_open() ? count - 1 : count - 2;
  }
};

/// Manifold with boundaries whose edges can be collapsed: flat arrays of 24 bytes per triangle and
/// 4 per vertex.
/// @see Campagna, Kobbelt, Seidel, Directed edges - a scalable representation for triangle meshes,
///      Journal of Graphics Tools 3(4) (1998).
class CollapsibleMesh {
 public:
  /// @param mesh  its positions are not used.
  explicit CollapsibleMesh(const ManifoldMesh& mesh);

  std::size_t vertices() const noexcept { return first_.size(); }
  /// Returns the initial number of triangles; each keeps its number.
  std::size_t numbers() const noexcept { return halves_.size() / 3; }
  /// Returns the current number of triangles.
  std::size_t triangles() const noexcept { return triangles_; }
  bool has_triangle(std::uint32_t number) const noexcept {
    return halves_[3 * std::size_t{number}].from != none;
  }
  bool has_vertex(std::uint32_t vertex) const noexcept { return first_[vertex] != none; }
  glm::uvec3 corners(std::uint32_t triangle) const noexcept {
    const std::size_t h = 3 * std::size_t{triangle};
    return {halves_[h].from, halves_[h + 1].from, halves_[h + 2].from};
  }
  std::uint32_t from(HalfEdge h) const noexcept { return halves_[h].from; }
  std::uint32_t to(HalfEdge h) const noexcept { return halves_[next_of(h)].from; }
  /// Returns the opposite half-edge, or `none` at the boundary.
  HalfEdge twin(HalfEdge h) const noexcept { return halves_[h].twin; }

  /// Collects the neighbourhood of a vertex.
  void gather(std::uint32_t vertex, Star& star) const;

  /// Returns true if the surface stays a manifold of the same topology when the centre moves onto
  /// ring[to]: the link condition holds, and no triangle vanishes whose two other edges are both on
  /// the boundary. For a star at the boundary, `to` must be the first or the last.
  /// @see Dey, Edelsbrunner, Guha, Nekhayev, Topology preserving edge contraction (1999).
  bool may_collapse(const Star& star, std::size_t to) const;

  /// Moves the centre onto ring[to]: one triangle vanishes at the boundary, otherwise two.
  void collapse(const Star& star, std::size_t to);

 private:
  void join(HalfEdge a, HalfEdge b) noexcept;
  void start_at(HalfEdge h) noexcept;
  bool shares_others(const Star& star, std::uint32_t onto, std::uint32_t apex,
                     std::uint32_t other_apex) const;

  struct Half {
    std::uint32_t from = none;  // none if the triangle vanished
    HalfEdge twin = none;
  };
  std::vector<Half> halves_;
  std::vector<HalfEdge> first_;  // of each vertex, from it: at the boundary the one without a twin
  std::size_t triangles_ = 0;
};

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
