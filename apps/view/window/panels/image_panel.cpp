#include "apps/view/window/panels/image_panel.h"

#include <fmt/format.h>

#include <QCheckBox>
#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QSlider>
#include <QToolButton>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>

#include "apps/view/rendering/colour_table.h"
#include "apps/view/window/panels/picture_area.h"
#include "apps/view/window/style.h"
#include "apps/view/window/widgets.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr int legend_margin_px = 6;
constexpr int band_px = 12;
constexpr int band_ticks = 5;
constexpr int few_ticks = 3;  // if there is no room for more
constexpr int steps_per_ev = 10;
constexpr int most_ev = 10;

bool has_exposure(const ImageChannel& channel) {
  return channel.kind == ImageChannel::Kind::Light || channel.kind == ImageChannel::Kind::AsStored;
}

double value_at(const ImageLegend& legend, double share) {
  return legend.is_logarithmic && legend.low > 0
             ? legend.low * math::pow(legend.high / legend.low, share)
             : legend.low + share * (legend.high - legend.low);
}

}  // namespace

// Legend of an image's channel: a colour bar with numbers, or categories by name.
class LegendStrip : public QWidget {
 public:
  explicit LegendStrip(QWidget* parent = nullptr);

  void show_legend(std::optional<ImageLegend> legend);
  QSize sizeHint() const override;
  QSize minimumSizeHint() const override { return {100, sizeHint().height()}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  void paint_band(QPainter& painter) const;
  void paint_categories(QPainter& painter) const;

  std::optional<ImageLegend> legend_;
};

LegendStrip::LegendStrip(QWidget* parent) : QWidget(parent) {
  setObjectName("image_legend");
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

void LegendStrip::show_legend(std::optional<ImageLegend> legend) {
  legend_ = std::move(legend);
  QStringList all;
  if (legend_) {
    for (const ImageLegend::Category& each : legend_->categories) {
      all << text_of("{}: {} pixels", each.name, each.pixels);
    }
  }
  setToolTip(all.join('\n'));
  update();
}

QSize LegendStrip::sizeHint() const {
  return {300, band_px + fontMetrics().height() + 3 * legend_margin_px / 2};
}

void LegendStrip::paintEvent(QPaintEvent*) {
  if (!legend_) return;
  QPainter painter(this);
  if (legend_->categories.empty()) {
    paint_band(painter);
  } else {
    paint_categories(painter);
  }
}

void LegendStrip::paint_band(QPainter& painter) const {
  const QRect band(legend_margin_px, legend_margin_px / 2, width() - 2 * legend_margin_px, band_px);
  QLinearGradient colours(band.topLeft(), band.topRight());
  if (legend_->colours.empty()) {
    colours.setColorAt(0, Qt::black);
    colours.setColorAt(1, Qt::white);
  }
  const double last = static_cast<double>(std::max<std::size_t>(legend_->colours.size(), 2) - 1);
  for (std::size_t i = 0; i < legend_->colours.size(); ++i) {
    colours.setColorAt(static_cast<double>(i) / last, colour_of(legend_->colours[i]));
  }
  painter.fillRect(band, colours);
  painter.setPen(palette().text().color());
  const int text_room_px = painter.fontMetrics().horizontalAdvance("000.0 mm  ");
  const int ticks = band_ticks * text_room_px <= width() ? band_ticks : few_ticks;
  for (int i = 0; i < ticks; ++i) {
    const double share = static_cast<double>(i) / (ticks - 1);
    const double x = band.left() + share * band.width();
    const std::string unit = i + 1 == ticks && !legend_->unit.empty() ? " " + legend_->unit : "";
    const QString text = text_of("{:.4g}{}", value_at(*legend_, share), unit);
    const double text_px = painter.fontMetrics().horizontalAdvance(text);
    const double left = std::clamp(x - text_px / 2, 0.0, std::max(0.0, width() - text_px - 2));
    painter.drawLine(QPointF(x, band.bottom()), QPointF(x, band.bottom() + 3));
    painter.drawText(QPointF(left, band.bottom() + 3 + painter.fontMetrics().ascent()), text);
  }
}

void LegendStrip::paint_categories(QPainter& painter) const {
  int x = legend_margin_px;
  int y = legend_margin_px / 2;
  const int line_px = painter.fontMetrics().height() + 1;
  for (const ImageLegend::Category& each : legend_->categories) {
    const QString text = QString::fromStdString(each.name);
    const int wide_px = band_px + 4 + painter.fontMetrics().horizontalAdvance(text) + 10;
    if (x + wide_px > width() && x > legend_margin_px) {
      x = legend_margin_px;
      y += line_px;
    }
    if (y + line_px > height() + 4) return;  // the tool tip lists all
    painter.fillRect(QRect(x, y + 2, band_px, line_px - 4), colour_of(each.colour));
    painter.setPen(palette().text().color());
    painter.drawText(QPoint(x + band_px + 4, y + painter.fontMetrics().ascent()), text);
    x += wide_px;
  }
}

ImagePanel::ImagePanel(Hooks hooks, QWidget* parent) : QWidget(parent), hooks_(std::move(hooks)) {
  build();
  connect(camera_, qOverload<int>(&QComboBox::currentIndexChanged), this, [this] {
    if (!is_filling_ && hooks_.camera_chosen) hooks_.camera_chosen(camera());
  });
  connect(channel_, qOverload<int>(&QComboBox::currentIndexChanged), this, [this] {
    if (is_filling_) return;
    channel_name_ = channel_->currentText().toStdString();
    redraw();
  });
  connect(exposure_, &QSlider::valueChanged, this, [this] {
    exposure_text_->setText(text_of("{:+.1f} EV", exposure_ev()));
    if (hooks_.exposed) hooks_.exposed(exposure_ev());
    redraw();
  });
  connect(echoes_, &QCheckBox::toggled, this, [this](bool on) {
    if (!on) area_->show_dots({});
    if (hooks_.echoes_wanted) hooks_.echoes_wanted();
  });
}

void ImagePanel::build() {
  camera_ = named(new QComboBox, "camera");
  channel_ = named(new QComboBox, "channel", "Quantity shown for each pixel");
  for (QComboBox* box : {camera_, channel_}) {
    box->setSizeAdjustPolicy(QComboBox::AdjustToContents);
    box->hide();
  }
  title_ = new QLabel;
  title_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  area_ = new PictureArea({.clicked =
                               [this](glm::ivec2 pixel) {
                                 if (image_ != nullptr && hooks_.clicked) hooks_.clicked(pixel);
                               },
                           .pointed = [this](auto pixel) { point_at(pixel); }});
  area_->setObjectName("picture");
  legend_ = new LegendStrip;
  values_ = named(wrapped_label(), "pixel_values");
  auto* row = new QHBoxLayout;
  echoes_ = named(new QCheckBox("Echoes"), "echoes",
                  "The echoes of the current scans, coloured by distance from the camera, at the "
                  "pixels that see them");
  echoes_->hide();
  add_widgets(*row, {camera_, channel_, echoes_});
  build_exposure(*row);
  row->addStretch(1);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(4, 4, 4, 4);
  layout->setSpacing(3);
  layout->addLayout(row);
  layout->addWidget(title_);
  layout->addWidget(area_, 1);
  add_widgets(*layout, {legend_, values_});
}

void ImagePanel::build_exposure(QBoxLayout& row) {
  exposure_ = named(new QSlider(Qt::Horizontal), "exposure",
                    "Exposure, in powers of 2, of images here and of pictures in the view");
  exposure_->setRange(-most_ev * steps_per_ev, most_ev * steps_per_ev);
  exposure_->setMinimumWidth(60);
  exposure_text_ = new QLabel("+0.0 EV");
  auto* automatic =
      named(new QToolButton, "automatic_exposure", "Expose so that 1 % of the values exceed white");
  automatic->setText("Auto");
  connect(automatic, &QToolButton::clicked, this, [this] {
    if (image_ == nullptr) return;
    const auto channel = static_cast<std::size_t>(channel_->currentIndex());
    set_exposure(automatic_exposure_ev(image_->channels()[channel]));
  });
  exposed_ = new QWidget;
  auto* layout = new QHBoxLayout(exposed_);
  layout->setContentsMargins(0, 0, 0, 0);
  add_widgets(*layout, {exposure_, exposure_text_, automatic});
  exposed_->hide();
  row.addWidget(exposed_, 1);
}

void ImagePanel::set_exposure(double exposure_ev) {
  exposure_->setValue(static_cast<int>(std::lround(exposure_ev * steps_per_ev)));
}

double ImagePanel::exposure_ev() const {
  return static_cast<double>(exposure_->value()) / steps_per_ev;
}

bool ImagePanel::wants_echoes() const {
  return echoes_->isChecked() && shown_ && shown_->timeline != nullptr;
}

void ImagePanel::show_echoes(const std::vector<EchoPixel>& echoes) {
  std::vector<float> depths_m;
  for (const EchoPixel& echo : echoes) depths_m.push_back(static_cast<float>(echo.depth_m));
  const glm::dvec2 span_m = colour_range(depths_m, ColourScale::Vivid);
  std::vector<PictureDot> dots;
  for (const EchoPixel& echo : echoes) {
    const double share = (echo.depth_m - span_m.x) / std::max(span_m.y - span_m.x, 1e-9);
    dots.push_back({echo.pixel, colour_of(colour_on(ColourScale::Vivid, share))});
  }
  area_->show_dots(std::move(dots));
}

void ImagePanel::set_cameras(const std::vector<std::string>& names) {
  is_filling_ = true;
  camera_->clear();
  for (const std::string& name : names) camera_->addItem(QString::fromStdString(name));
  camera_->setVisible(!names.empty());
  is_filling_ = false;
  if (!names.empty() && hooks_.camera_chosen) hooks_.camera_chosen(names.front());
}

std::string ImagePanel::camera() const { return camera_->currentText().toStdString(); }

void ImagePanel::show_image(const ImageSource& source) {
  if (source_ && source_->file == source.file) {
    next_.reset();
    return;
  }
  if (job_.is_running()) {
    next_ = source;
  } else {
    read(source);
  }
}

void ImagePanel::read(const ImageSource& source) {
  source_ = source;
  start([source, wanted = channel_name_, ev = exposure_ev()] {
    const auto image = source.is_frame
                           ? std::make_shared<const RecordedImage>(source.file, source.names)
                           : std::make_shared<const RecordedImage>(source.file);
    const std::size_t channel = image->find(wanted).value_or(0);
    return Shown{source, image, channel, image->draw(channel, std::nullopt, ev)};
  });
}

void ImagePanel::redraw() {
  if (image_ == nullptr) return;
  if (job_.is_running()) {
    is_stale_ = true;
    return;
  }
  const std::size_t channel = image_->find(channel_name_).value_or(0);
  start([source = *shown_, image = image_, channel, ev = exposure_ev()] {
    return Shown{source, image, channel, image->draw(channel, std::nullopt, ev)};
  });
}

void ImagePanel::start(std::function<Shown()> work) {
  is_stale_ = false;
  const auto ended = [this] {
    if (next_) {
      const ImageSource next = *next_;
      next_.reset();
      read(next);
    } else if (is_stale_) {
      redraw();
    }
  };
  job_.start([work = std::move(work)](const auto&, const auto&) { return work(); },
             [this](Shown shown) { take(std::move(shown)); },
             {.failed =
                  [this](const std::string& fault) {
                    source_.reset();
                    show_nothing("this image cannot be read");
                    if (hooks_.failed) hooks_.failed(fault);
                  },
              .ended = ended});
}

void ImagePanel::take(Shown shown) {
  const bool is_another = !shown_ || shown_->file != shown.source.file;
  if (is_another) {  // these belong to the previous image
    area_->mark(std::nullopt);
    area_->show_dots({});
  }
  shown_ = std::move(shown.source);
  image_ = std::move(shown.image);
  is_filling_ = true;
  channel_->clear();
  for (const ImageChannel& each : image_->channels()) {
    channel_->addItem(QString::fromStdString(each.name));
  }
  channel_->setCurrentIndex(static_cast<int>(shown.channel));
  channel_->show();
  if (values_->text().isEmpty()) values_->setText("point at a pixel; a click shows its ray");
  is_filling_ = false;
  area_->show_picture(shown.drawn.picture);
  show_controls(image_->channels()[shown.channel]);
  const bool is_picture = image_->channels()[shown.channel].kind == ImageChannel::Kind::AsStored;
  legend_->show_legend(is_picture ? std::nullopt : std::optional(shown.drawn.legend));
  const glm::ivec2 size = image_->size_px();
  title_->setText(text_of("{}   {} x {} px", shown_->title, size.x, size.y));
  if (is_another && hooks_.echoes_wanted) hooks_.echoes_wanted();
}

void ImagePanel::show_controls(const ImageChannel& channel) {
  exposed_->setVisible(has_exposure(channel));
  echoes_->setVisible(shown_->timeline != nullptr);
}

void ImagePanel::clear(const QString& why) {
  job_.abandon();
  is_stale_ = false;
  source_.reset();
  next_.reset();
  show_nothing(why);
}

void ImagePanel::show_nothing(const QString& why) {
  image_ = nullptr;
  shown_.reset();
  area_->clear(why);
  legend_->show_legend(std::nullopt);
  title_->clear();
  values_->clear();
  for (QWidget* each : {static_cast<QWidget*>(channel_), static_cast<QWidget*>(echoes_), exposed_})
    each->hide();
  area_->show_dots({});
  is_filling_ = true;
  channel_->clear();
  is_filling_ = false;
}

void ImagePanel::mark(std::optional<glm::dvec2> pixel) { area_->mark(pixel); }

void ImagePanel::point_at(std::optional<glm::ivec2> pixel) {
  if (image_ == nullptr || !pixel) return;
  std::string text = fmt::format("({}, {})", pixel->x, pixel->y);
  std::string all;
  for (const PixelValue& value : image_->values_at(*pixel)) {
    const bool is_shown = value.channel == channel_->currentText().toStdString();
    if (is_shown) text += fmt::format("   {}: {}", value.channel, value.text);
    all += fmt::format("{}: {}\n", value.channel, value.text);
  }
  values_->setText(QString::fromStdString(text));
  area_->setToolTip(QString::fromStdString(all).trimmed());
}

}  // namespace groundray
