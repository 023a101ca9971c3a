#include <tbb/parallel_for.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "apps/view/layers/ground_colour.h"
#include "apps/view/rendering/picture_file.h"
#include "core/image/image.h"

namespace groundray {
namespace {

constexpr int side_px = 1024;       // width of a square
constexpr int squares_in_row = 4;   // squares per row of the texture
constexpr int most_squares = 12;    // 4096 x 3072 texels
constexpr double border_px = 2;     // margin between triangles and a square's edge, for filtering
constexpr double texel_rad = 1e-3;  // angle of a texel seen from straight above, about a pixel
constexpr double smallest_texel_m = 2e-3;
constexpr auto no_triangle = std::numeric_limits<std::uint32_t>::max();

// Triangles of a layer's data, in the layer's frame.
struct Surface {
  std::span<const float> at;
  std::span<const std::int32_t> corner;
  vtkDataArray* normals;

  explicit Surface(vtkPolyData& data)
      : at(coordinates(data)), corner(corners(data)), normals(data.GetPointData()->GetNormals()) {}
  std::size_t triangles() const { return corner.size() / 3; }
  std::int32_t point_of(std::size_t triangle, std::size_t k) const {
    return corner[3 * triangle + k];
  }
  glm::dvec3 place(std::size_t triangle, std::size_t k) const {
    return point_at(at, point_of(triangle, k));
  }
  glm::dvec3 normal(std::size_t triangle, std::size_t k) const {
    glm::dvec3 n;
    normals->GetTuple(point_of(triangle, k), &n.x);
    return n;
  }
};

// Nested squares round the eye, in the layer's frame.
struct Squares {
  glm::dvec2 eye_m{0};
  double texel_m = 1;  // texel size of the smallest square
  int count = 1;

  double texel_of(int square) const { return std::ldexp(texel_m, square); }
  double half_m(int square) const { return texel_of(square) * side_px / 2; }
  // Column and row from the square's north-western corner; integers are texel edges.
  glm::dvec2 texel_at(int square, const glm::dvec2& p) const {
    const glm::dvec2 off = (p - eye_m) / texel_of(square);
    return glm::dvec2(off.x, -off.y) + side_px / 2.0;
  }
  bool holds(int square, const glm::dvec2& p) const {
    const glm::dvec2 off = glm::abs(p - eye_m);
    return std::max(off.x, off.y) <= half_m(square) - border_px * texel_of(square);
  }
  int smallest_for(const Surface& surface, std::size_t triangle) const {
    for (int square = 0; square + 1 < count; ++square) {
      bool is_in = true;
      for (std::size_t k = 0; k < 3 && is_in; ++k)
        is_in = holds(square, glm::dvec2(surface.place(triangle, k)));
      if (is_in) return square;
    }
    return count - 1;
  }
  static glm::ivec2 first_px(int square) {
    return glm::ivec2(square % squares_in_row, square / squares_in_row) * side_px;
  }
  glm::ivec2 size_px() const {
    return glm::ivec2(std::min(count, squares_in_row), (count - 1) / squares_in_row + 1) * side_px;
  }
};

Squares squares_for(const Surface& surface, const glm::dvec3& eye_m) {
  Squares squares{.eye_m = glm::dvec2(eye_m)};
  double farthest_m = 0, nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < surface.at.size() / 3; ++i) {
    const glm::dvec3 p = point_at(surface.at, i);
    const glm::dvec2 off = glm::abs(glm::dvec2(p - eye_m));
    farthest_m = std::max({farthest_m, off.x, off.y});
    nearest_m = std::min(nearest_m, glm::length(p - eye_m));
  }
  squares.texel_m = std::max(smallest_texel_m, texel_rad * nearest_m);
  while (squares.count < most_squares && squares.half_m(squares.count - 1) < 1.01 * farthest_m)
    ++squares.count;
  // If the largest square does not reach the farthest point, all squares become coarser.
  const double half_m = squares.half_m(squares.count - 1);
  if (half_m < 1.01 * farthest_m) squares.texel_m *= 1.01 * farthest_m / half_m;
  return squares;
}

// Returns the barycentric coordinates of p in the triangle a, b, c.
glm::dvec3 shares_at(const glm::dvec2& p, const glm::dvec2& a, const glm::dvec2& b,
                     const glm::dvec2& c) {
  const auto cross = [](const glm::dvec2& u, const glm::dvec2& v) { return u.x * v.y - u.y * v.x; };
  const double area = cross(b - a, c - a);
  const glm::dvec2 shares(cross(p - a, c - a) / area, cross(b - a, p - a) / area);
  return {1 - shares.x - shares.y, shares.x, shares.y};
}

// Returns true if a texel lies in the next smaller square: the middle half of the width.
bool is_in_smaller(int square, const glm::ivec2& texel) {
  const glm::ivec2 at = texel - side_px / 4;
  return square > 0 && at.x >= 0 && at.y >= 0 && at.x < side_px / 2 && at.y < side_px / 2;
}

// Returns the index of the triangle under the centre of each texel of a square.
std::vector<std::uint32_t> triangles_under(const Squares& squares, int square,
                                           const Surface& surface) {
  std::vector<std::uint32_t> under(std::size_t{side_px} * side_px, no_triangle);
  for (std::size_t i = 0; i < surface.triangles(); ++i) {
    const glm::dvec2 a = squares.texel_at(square, glm::dvec2(surface.place(i, 0)));
    const glm::dvec2 b = squares.texel_at(square, glm::dvec2(surface.place(i, 1)));
    const glm::dvec2 c = squares.texel_at(square, glm::dvec2(surface.place(i, 2)));
    const glm::ivec2 low(glm::clamp(glm::ceil(glm::min(a, glm::min(b, c)) - 0.5), 0.0, 1e4));
    const glm::ivec2 high(
        glm::clamp(glm::floor(glm::max(a, glm::max(b, c)) - 0.5), -1.0, side_px - 1.0));
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) {
        const glm::dvec3 shares = shares_at(glm::dvec2(x, y) + 0.5, a, b, c);
        if (std::min({shares.x, shares.y, shares.z}) >= -1e-9)
          under[static_cast<std::size_t>(y) * side_px + static_cast<std::size_t>(x)] =
              static_cast<std::uint32_t>(i);
      }
    }
  }
  return under;
}

// Paints one square of the texture.
struct SquarePainter {
  const Squares& squares;
  int square = 0;
  const Surface& surface;
  glm::dvec3 offset_m;
  const GroundColour& ground;
  Image8& texture;
  std::vector<std::uint32_t> triangle_under;

  void paint() {
    tbb::parallel_for(0, side_px, [&](int y) {
      for (int x = 0; x < side_px; ++x) {
        if (is_in_smaller(square, {x, y})) {
          take_from_smaller({x, y});
        } else if (under({x, y}) != no_triangle) {
          put({x, y}, colour_at({x, y}));
        }
      }
    });
    for (int y = 0; y < side_px; ++y) {
      for (int x = 0; x < side_px; ++x) {
        if (under({x, y}) == no_triangle) put({x, y}, colour_beside({x, y}));
      }
    }
  }

  std::uint32_t under(glm::ivec2 texel) const {
    return triangle_under[static_cast<std::size_t>(texel.y) * side_px +
                          static_cast<std::size_t>(texel.x)];
  }
  glm::u8vec3 get(int of, glm::ivec2 texel) const {
    const glm::ivec2 at = Squares::first_px(of) + texel;
    const auto pixel = texture.at(at.x, at.y);
    return {pixel[0], pixel[1], pixel[2]};
  }
  void put(glm::ivec2 texel, const glm::u8vec3& colour) {
    const glm::ivec2 at = Squares::first_px(square) + texel;
    const auto pixel = texture.at(at.x, at.y);
    for (glm::length_t k = 0; k < 3; ++k) pixel[static_cast<std::size_t>(k)] = colour[k];
  }

  void take_from_smaller(glm::ivec2 texel) {
    const glm::ivec2 first = 2 * (texel - side_px / 4);
    glm::uvec3 sum(2);
    for (const glm::ivec2 more : {glm::ivec2(0, 0), {1, 0}, {0, 1}, {1, 1}})
      sum += glm::uvec3(get(square - 1, first + more));
    put(texel, glm::u8vec3(sum / 4U));
  }

  glm::u8vec3 colour_at(glm::ivec2 texel) const {
    const std::size_t triangle = under(texel);
    const glm::dvec2 from(texel.x + 0.5 - side_px / 2.0, side_px / 2.0 - texel.y - 0.5);
    const glm::dvec2 p = squares.eye_m + from * squares.texel_of(square);
    const glm::dvec3 a = surface.place(triangle, 0), b = surface.place(triangle, 1),
                     c = surface.place(triangle, 2);
    const glm::dvec3 shares = shares_at(p, glm::dvec2(a), glm::dvec2(b), glm::dvec2(c));
    const double z = glm::dot(shares, glm::dvec3(a.z, b.z, c.z));
    const glm::dvec3 normal = shares.x * surface.normal(triangle, 0) +
                              shares.y * surface.normal(triangle, 1) +
                              shares.z * surface.normal(triangle, 2);
    return ground.shown_at(
        GroundCover::on_facet(offset_m + glm::dvec3(p, z), glm::normalize(normal)),
        squares.texel_of(square));
  }

  // Returns the colour for a texel without ground: that of a neighbour with ground, since bilinear
  // filtering reads it; otherwise grey.
  glm::u8vec3 colour_beside(glm::ivec2 texel) const {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const glm::ivec2 at = texel + glm::ivec2(dx, dy);
        if (at.x < 0 || at.y < 0 || at.x >= side_px || at.y >= side_px) continue;
        if (under(at) != no_triangle) return get(square, at);
      }
    }
    return glm::u8vec3(128);
  }
};

// Appends copies of points with all their values.
void append_points(vtkPolyData& data, const std::vector<std::int32_t>& of) {
  vtkPoints& points = *data.GetPoints();
  std::vector<double> row;
  for (int i = 0; i < data.GetPointData()->GetNumberOfArrays(); ++i) {
    vtkDataArray& array = *data.GetPointData()->GetArray(i);
    row.resize(static_cast<std::size_t>(array.GetNumberOfComponents()));
    for (const std::int32_t point : of) {
      array.GetTuple(point, row.data());
      array.InsertNextTuple(row.data());
    }
  }
  for (const std::int32_t point : of) {
    glm::dvec3 p;
    points.GetPoint(point, &p.x);
    points.InsertNextPoint(&p.x);
  }
}

// Assigns texture coordinates to each triangle, in the smallest square that contains it.
void assign_texture(vtkPolyData& data, const Squares& squares) {
  const Surface surface(data);
  std::vector<int> square_of(surface.at.size() / 3, -1);
  std::map<std::pair<std::int32_t, int>, std::uint32_t> copies;
  std::vector<std::int32_t> copied;
  std::vector<glm::uvec3> triangles(surface.triangles());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const int square = squares.smallest_for(surface, i);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t point = surface.point_of(i, k);
      int& first = square_of[static_cast<std::size_t>(point)];
      if (first < 0) first = square;
      auto number = static_cast<std::uint32_t>(point);
      if (first != square) {
        const auto next = static_cast<std::uint32_t>(surface.at.size() / 3 + copied.size());
        const auto [found, is_new] = copies.try_emplace({point, square}, next);
        if (is_new) copied.push_back(point);
        number = found->second;
      }
      triangles[i][static_cast<glm::length_t>(k)] = number;
    }
  }
  square_of.resize(square_of.size() + copied.size());
  for (const auto& [of, number] : copies) square_of[number] = of.second;
  append_points(data, copied);
  set_triangles(data, triangles);
  const std::span<const float> at = coordinates(data);
  const glm::dvec2 size(squares.size_px());
  std::vector<glm::vec2> places(square_of.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const int square = std::max(square_of[i], 0);
    const glm::dvec2 texel = glm::dvec2(Squares::first_px(square)) +
                             squares.texel_at(square, glm::dvec2(point_at(at, i)));
    places[i] = {texel.x / size.x, 1 - texel.y / size.y};
  }
  set_texture_coordinates(data, places);
}

}  // namespace

void drape_ground(Layer& terrain, const Simulation& simulation, const glm::dvec3& eye_m) {
  const auto ground = GroundColour::of(simulation);
  if (!ground || !ground->varies() || terrain.triangles() == 0) return;
  const glm::dvec3 offset_m = terrain.origin_w_m - simulation.terrain.header().origin_w_m;
  const Surface surface(*terrain.data);
  const Squares squares = squares_for(surface, eye_m - offset_m);
  Image8 texture(squares.size_px().x, squares.size_px().y, 3);
  std::vector<std::vector<std::uint32_t>> under(static_cast<std::size_t>(squares.count));
  tbb::parallel_for(0, squares.count, [&](int square) {
    under[static_cast<std::size_t>(square)] = triangles_under(squares, square, surface);
  });
  for (int square = 0; square < squares.count; ++square) {
    SquarePainter{squares,
                  square,
                  surface,
                  offset_m,
                  *ground,
                  texture,
                  std::move(under[static_cast<std::size_t>(square)])}
        .paint();
  }
  assign_texture(*terrain.data, squares);
  if (terrain.coarse != nullptr) assign_texture(*terrain.coarse, squares);
  terrain.texture = make_texture(texture);
  terrain.texture->MipmapOff();  // mipmaps would blend adjacent squares
}

}  // namespace groundray
