#include <fmt/format.h>

#include <QAbstractButton>
#include <QComboBox>
#include <QDockWidget>
#include <QImage>
#include <QLabel>
#include <QTest>
#include <cstdlib>
#include <fstream>
#include <map>

#include "apps/view/window/window.h"
#include "test/view/sample_dataset.h"
#include "test/view/window_fixture.h"

namespace groundray::window_golden_test {
namespace {

using testing::SampleDataset;
using Rectangles = std::map<std::string, QRect>;

constexpr QSize view_px(520, 520);  // fixed, whatever space the fonts require

// Brightness in blocks of 4 x 4 pixels, on which differences of font rendering have little effect.
std::vector<std::vector<double>> brightness(const QImage& picture) {
  constexpr int block_px = 4;
  std::vector<std::vector<double>> rows;
  for (int y = 0; y + block_px <= picture.height(); y += block_px) {
    rows.emplace_back();
    for (int x = 0; x + block_px <= picture.width(); x += block_px) {
      double sum = 0;
      for (int k = 0; k < block_px * block_px; ++k) {
        sum += qGray(picture.pixel(x + k % block_px, y + k / block_px));
      }
      rows.back().push_back(sum / (block_px * block_px));
    }
  }
  return rows;
}

// Structural similarity, 1 for equal images, over windows of 8 x 8 blocks: Wang, Bovik, Sheikh and
// Simoncelli, Image quality assessment, IEEE Transactions on Image Processing 13(4) (2004).
double similarity(const QImage& one, const QImage& other) {
  constexpr std::size_t side = 8;
  constexpr double c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
  const auto a = brightness(one), b = brightness(other);
  double sum = 0;
  int windows = 0;
  for (std::size_t y = 0; y + side <= std::min(a.size(), b.size()); y += side / 2) {
    for (std::size_t x = 0; x + side <= std::min(a[y].size(), b[y].size()); x += side / 2) {
      double of_a = 0, of_b = 0, aa = 0, bb = 0, ab = 0;
      for (std::size_t k = 0; k < side * side; ++k) {
        const double p = a[y + k / side][x + k % side], q = b[y + k / side][x + k % side];
        of_a += p / (side * side);
        of_b += q / (side * side);
        aa += p * p / (side * side);
        bb += q * q / (side * side);
        ab += p * q / (side * side);
      }
      const double spread = aa - of_a * of_a + bb - of_b * of_b;
      sum += (2 * of_a * of_b + c1) * (2 * (ab - of_a * of_b) + c2) /
             ((of_a * of_a + of_b * of_b + c1) * (spread + c2));
      ++windows;
    }
  }
  return sum / windows;
}

QRect rectangle_of(const QWidget& widget, const QWidget& window) {
  return {widget.mapTo(&window, QPoint(0, 0)), widget.size()};
}

// Rectangles of the view and the visible panels.
Rectangles rectangles_of(Window& window) {
  Rectangles all{{"view", rectangle_of(window.canvas(), window)}};
  for (const QDockWidget* dock : window.findChildren<QDockWidget*>()) {
    if (dock->visibleRegion().isEmpty()) continue;
    all[dock->windowTitle().toStdString()] = rectangle_of(*dock, window);
  }
  return all;
}

Rectangles read_rectangles(const std::filesystem::path& path) {
  Rectangles all;
  std::ifstream file(path);
  std::string name;
  for (int x = 0, y = 0, w = 0, h = 0;
       file >> x >> y >> w >> h && std::getline(file >> std::ws, name);) {
    all[name] = QRect(x, y, w, h);
  }
  return all;
}

double shared_share(const QRect& a, const QRect& b) {
  const auto area = [](const QRect& r) {
    return r.isEmpty() ? 0.0 : static_cast<double>(r.width()) * r.height();
  };
  const double shared = area(a & b);
  return shared / (area(a) + area(b) - shared);
}

class WindowGoldenTest : public testing::WindowTest {
 protected:
  // Shows a scene and its dataset at a time at which all sensors have recorded something.
  void show_work() {
    shown();
    window_->canvas().setFixedSize(view_px);
    open(SampleDataset::get().scene());
    open(SampleDataset::get().path());
    window_->timeline_panel().go_to(std::chrono::milliseconds(300));
    settle();
    window_->view().colour_by("dataset/lidar/top", "range");
    window_->layer_panel().select("dataset/lidar/top");
    const glm::dvec3 platform_m(82, 80, 54);
    window_->canvas().look({platform_m + glm::dvec3(-14, -20, 14), platform_m});
    settle();
    view_on_screen();
  }

  QImage on_screen() const {
    const QPoint corner = window_->mapToGlobal({0, 0});
    return QGuiApplication::primaryScreen()
        ->grabWindow(0, corner.x(), corner.y(), window_->width(), window_->height())
        .toImage();
  }
};

// To renew the golden picture and its rectangles, set GROUNDRAY_NEW_GOLDEN to the folder into which
// this test then writes them.
TEST_F(WindowGoldenTest, WindowMatchesTheGoldenImage) {
  show_work();
  const QImage now = on_screen();
  const Rectangles rectangles = rectangles_of(*window_);
  if (const char* folder = std::getenv("GROUNDRAY_NEW_GOLDEN"); folder != nullptr) {
    now.save(QString::fromStdString(std::string(folder) + "/window.png"));
    std::ofstream file(std::string(folder) + "/window.txt");
    for (const auto& [name, r] : rectangles) {
      file << fmt::format("{} {} {} {} {}\n", r.x(), r.y(), r.width(), r.height(), name);
    }
  }
  const auto golden_folder = testing::data_folder().parent_path() / "test/view/golden";
  const QImage golden(QString::fromStdString((golden_folder / "window.png").string()));
  ASSERT_FALSE(golden.isNull());
  const Rectangles then = read_rectangles(golden_folder / "window.txt");
  ASSERT_EQ(then.size(), rectangles.size());
  for (const auto& [name, rectangle] : then) {
    ASSERT_TRUE(rectangles.contains(name)) << name;
    // Fonts that are a fifth wider can move two of a panel's four edges by as much.
    EXPECT_GT(shared_share(rectangle, rectangles.at(name)), 0.65) << name;
  }
  // The picture depends on fonts only in the legend, which covers a tenth of it.
  const QImage view_now = now.copy(rectangles.at("view"));
  const QImage view_then = golden.copy(then.at("view"));
  ASSERT_EQ(view_now.size(), view_then.size());
  EXPECT_GT(similarity(view_now, view_then), 0.9);
  EXPECT_GT(similarity(now, golden), 0.6);
  // The saved picture equals the displayed one.
  const testing::TemporaryFolder folder;
  window_->save_picture(folder / "saved.png", {view_px.width(), view_px.height()});
  const QImage saved(QString::fromStdString((folder / "saved.png").string()));
  EXPECT_GT(similarity(saved, view_now), 0.9);
  // Check of the measure: it distinguishes views with and without a scan, and a window without
  // panels.
  window_->view().set_visible("dataset/lidar/top", false);
  view_on_screen();
  EXPECT_TRUE(testing::wait_until([&] {  // a busy X server shows it late
    return similarity(on_screen().copy(rectangles.at("view")), view_then) < 0.9;
  }));
  QImage bare = now;
  bare.fill(now.pixel(now.width() / 2, 5));
  EXPECT_LT(similarity(bare, golden), 0.5);
}

// All visible texts have the space that they need, also in a window that fits a small screen.
TEST_F(WindowGoldenTest, TextsAreNotCutOff) {
  show_work();
  window_->canvas().setMinimumSize(200, 150);
  window_->canvas().setMaximumSize(QWIDGETSIZE_MAX, QWIDGETSIZE_MAX);
  QTest::qWait(100);
  for (const QSize size : {QSize(1280, 720), QSize(1200, 760)}) {
    window_->resize(size);
    for (const Qt::Key panel : {Qt::Key_N, Qt::Key_C, Qt::Key_B}) {
      QTest::keyClick(window_.get(), panel);
      settle();
      EXPECT_EQ(window_->size(), size) << "the panels need more";
      for (const QWidget* widget : window_->findChildren<QWidget*>()) {
        const auto* label = qobject_cast<const QLabel*>(widget);
        const bool is_text = label != nullptr && !label->wordWrap() && !label->text().isEmpty() &&
                             label->sizePolicy().horizontalPolicy() != QSizePolicy::Ignored;
        const bool is_button = qobject_cast<const QAbstractButton*>(widget) != nullptr;
        const bool is_ours = !widget->objectName().startsWith("qt_");
        if (widget->visibleRegion().isEmpty() || !is_ours || (!is_text && !is_button)) continue;
        EXPECT_GE(widget->width(), widget->minimumSizeHint().width())
            << widget->metaObject()->className() << ' ' << widget->objectName().toStdString() << ' '
            << (is_text ? label->text().toStdString() : "");
      }
    }
  }
}

}  // namespace
}  // namespace groundray::window_golden_test
