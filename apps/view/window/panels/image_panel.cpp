#include "apps/view/window/panels/image_panel.h"

#include <fmt/format.h>

#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QVBoxLayout>

#include "apps/view/window/panels/legend_strip.h"
#include "apps/view/window/panels/picture_area.h"

namespace groundray {

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
}

void ImagePanel::build() {
  camera_ = new QComboBox;
  camera_->setObjectName("camera");
  camera_->setSizeAdjustPolicy(QComboBox::AdjustToContents);
  camera_->hide();
  channel_ = new QComboBox;
  channel_->setObjectName("channel");
  channel_->setToolTip("Quantity shown for each pixel");
  channel_->setSizeAdjustPolicy(QComboBox::AdjustToContents);
  channel_->hide();
  title_ = new QLabel;
  title_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  area_ = new PictureArea({.clicked =
                               [this](glm::ivec2 pixel) {
                                 if (image_ != nullptr && hooks_.clicked) hooks_.clicked(pixel);
                               },
                           .pointed = [this](auto pixel) { point_at(pixel); }});
  area_->setObjectName("picture");
  legend_ = new LegendStrip;
  values_ = new QLabel;
  values_->setWordWrap(true);
  values_->setObjectName("pixel_values");
  auto* row = new QHBoxLayout;
  row->addWidget(camera_);
  row->addWidget(channel_);
  row->addStretch(1);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(4, 4, 4, 4);
  layout->setSpacing(3);
  layout->addLayout(row);
  layout->addWidget(title_);
  layout->addWidget(area_, 1);
  layout->addWidget(legend_);
  layout->addWidget(values_);
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
  start([source, wanted = channel_name_] {
    const auto image = source.is_frame
                           ? std::make_shared<const RecordedImage>(source.file, source.names)
                           : std::make_shared<const RecordedImage>(source.file);
    const std::size_t channel = image->find(wanted).value_or(0);
    return Shown{source, image, channel, image->draw(channel)};
  });
}

void ImagePanel::redraw() {
  if (image_ == nullptr) return;
  if (job_.is_running()) {
    is_stale_ = true;
    return;
  }
  const std::size_t channel = image_->find(channel_name_).value_or(0);
  start([source = *shown_, image = image_, channel] {
    return Shown{source, image, channel, image->draw(channel)};
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
  if (is_another) area_->mark(std::nullopt);  // it belongs to the previous image
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
  const bool is_picture = image_->channels()[shown.channel].kind == ImageChannel::Kind::Picture;
  legend_->show_legend(is_picture ? std::nullopt : std::optional(shown.drawn.legend));
  const glm::ivec2 size = image_->size_px();
  title_->setText(
      QString::fromStdString(fmt::format("{}   {} x {} px", shown_->title, size.x, size.y)));
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
  channel_->hide();
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
