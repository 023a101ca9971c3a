#include "apps/view/window/panels/scan_panel.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QVBoxLayout>
#include <exception>
#include <glm/trigonometric.hpp>

#include "apps/view/layers/cloud_layer.h"
#include "apps/view/layers/line_layer.h"
#include "apps/view/window/widgets.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr double marker_m = 1.5;
const QString no_ground = QStringLiteral("Open a scene or a DEM: its ground can be scanned.");
const QString bare_ground =
    QStringLiteral("A DEM has no materials: bare, grey ground without sun is assumed.");

// Returns the sensor as a dataset would describe it, for the beams of its echoes.
RecordedSensor recorded(const SensorPreset& preset, const Pose& X_DS,
                        std::chrono::nanoseconds stamp) {
  using namespace std::chrono_literals;
  return {.name = preset.name,
          .model = preset.model,
          .kind = SensorKind::Lidar,
          .X_DS = Trajectory({{stamp - 10s, X_DS}, {stamp + 10s, X_DS}}),
          .X_BS = {},
          .frames = {{0, stamp, {}}},
          .pending = 0,
          .lasts = 0ns,
          .points = preset.lidar.points,
          .lidar = LidarFacts{preset.lidar, true},
          .camera = std::nullopt};
}

RecordedNames names_of(const Simulation& simulation) {
  RecordedNames names;
  for (const SceneObjects::Group& group : simulation.scene_objects.groups) {
    names.objects.push_back({group.name, group.label, group.first, group.count});
    std::string& name = names.labels[group.label];
    name += (name.empty() ? "" : ", ") + group.name;
  }
  return names;
}

FinishedScan made_of(const Simulation& simulation, const SensorPreset& preset, const Pose& X_DS,
                     PlacedScan placed, const std::string& name) {
  auto cloud = std::make_shared<const PointCloud>(std::move(placed.scan.echoes));
  const glm::dvec3 origin_w_m = simulation.terrain.header().origin_w_m;
  CloudContent content{.name = name, .p_m = positions_of(*cloud), .origin_w_m = origin_w_m};
  for (glm::dvec3& p : content.p_m) p = X_DS * p;
  FinishedScan made{cloud_layer(content, *cloud),
                    {std::make_shared<const RecordedSensor>(recorded(preset, X_DS, placed.stamp)),
                     {0, placed.stamp, {}},
                     cloud,
                     names_of(simulation),
                     origin_w_m},
                    std::move(placed.notes)};
  made.layer.facts.push_back(fmt::format("{}, {} echoes", preset.model, cloud->rows()));
  return made;
}

}  // namespace

ScanPanel::ScanPanel(Hooks hooks, QWidget* parent) : QWidget(parent), hooks_(std::move(hooks)) {
  build();
  connect_widgets();
  take_ground(nullptr, {});
}

void ScanPanel::build() {
  preset_ = named(new QComboBox, "preset");
  height_ = new QDoubleSpinBox;
  height_->setRange(0.05, 1000);
  height_->setValue(1.8);
  height_->setSingleStep(0.1);
  height_->setSuffix(" m");
  heading_ =
      named(new QDoubleSpinBox, "heading", "Direction of the sensor's x axis, from east to north");
  heading_->setRange(-360, 360);
  heading_->setSuffix(" deg");
  tilt_ = new QCheckBox("Tilt with the ground");
  place_ = named(new QPushButton("Place it in the view"), "place",
                 "Press at its position, drag in its direction");
  where_ = wrapped_label();
  scan_ = named(new QPushButton("Scan"), "scan");
  cancel_ = named(new QPushButton("Cancel"), "cancel");
  progress_ = progress_bar();
  status_ = named(wrapped_label(), "scan_status");
  auto* form = new QFormLayout;
  form->addRow("Sensor", preset_);
  form->addRow("Above ground", height_);
  form->addRow("Heading", heading_);
  form->addRow("", tilt_);
  form->addRow("Place", where_);
  form->setSpacing(5);
  auto* buttons = new QHBoxLayout;
  add_widgets(*buttons, {scan_, cancel_});
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(8, 6, 8, 6);
  layout->setSpacing(5);
  layout->addLayout(form);
  layout->addWidget(place_);
  layout->addLayout(buttons);
  add_widgets(*layout, {progress_, status_});
  layout->addStretch(1);
}

void ScanPanel::connect_widgets() {
  connect(place_, &QPushButton::clicked, this, [this] { ask_for_place(); });
  connect(scan_, &QPushButton::clicked, this, [this] { scan(); });
  connect(cancel_, &QPushButton::clicked, this, [this] { cancel(); });
  for (QDoubleSpinBox* box : {height_, heading_}) {
    connect(box, qOverload<double>(&QDoubleSpinBox::valueChanged), this, [this] { show_place(); });
  }
  connect(tilt_, &QCheckBox::toggled, this, [this] { show_place(); });
}

void ScanPanel::set_world(std::shared_ptr<const Simulation> simulation) {
  if (dem_.empty() && simulation == simulation_) return;
  take_ground(std::move(simulation), {});
}

void ScanPanel::set_dem(const std::filesystem::path& dem) {
  if (dem != dem_) take_ground(nullptr, dem);
}

void ScanPanel::take_ground(std::shared_ptr<const Simulation> simulation,
                            const std::filesystem::path& dem) {
  const bool was_running = job_.is_running();
  job_.abandon();
  simulation_ = std::move(simulation);
  dem_ = dem;
  scanner_ = nullptr;
  at_m_.reset();
  where_->setText("none yet");
  const bool has_ground = simulation_ != nullptr || !dem_.empty();
  status_->setText(!has_ground    ? no_ground
                   : was_running  ? "Cancelled: the ground has changed."
                   : dem_.empty() ? QString()
                                  : bare_ground);
  if (has_ground && presets_.empty()) {
    try {
      presets_ = lidar_presets();
    } catch (const std::exception& error) {
      if (hooks_.failed) hooks_.failed(error.what());
    }
    for (const SensorPreset& preset : presets_) {
      preset_->addItem(QString::fromStdString(preset.model), QString::fromStdString(preset.name));
    }
  }
  update_buttons();
}

void ScanPanel::choose(const std::string& preset) {
  const int index = preset_->findData(QString::fromStdString(preset));
  if (index >= 0) preset_->setCurrentIndex(index);
}

void ScanPanel::update_buttons() {
  const bool has_ground = (simulation_ != nullptr || !dem_.empty()) && !presets_.empty();
  for (QWidget* each : std::initializer_list<QWidget*>{preset_, height_, heading_, tilt_, place_}) {
    each->setEnabled(has_ground && !is_scanning());
  }
  scan_->setEnabled(has_ground && at_m_ && !is_scanning());
  cancel_->setEnabled(is_scanning());
  progress_->setVisible(is_scanning());
}

SensorPlace ScanPanel::place() const {
  return {.at_m = *at_m_,
          .height_m = height_->value(),
          .heading_rad = glm::radians(heading_->value()),
          .stance = tilt_->isChecked() ? Stance::OnSlope : Stance::Upright};
}

// Calls a function now if the ground is loaded, otherwise once the DEM is read.
void ScanPanel::with_ground(std::function<void()> then) {
  if (simulation_ != nullptr) return then();
  if (dem_.empty() || is_scanning()) return;
  const auto work = [dem = dem_](const std::stop_token& stop, const JobProgress&) {
    return std::make_shared<const Simulation>(simulation_of_dem(dem, stop));
  };
  const auto done = [this, then = std::move(then)](std::shared_ptr<const Simulation> simulation) {
    simulation_ = std::move(simulation);
    then();
  };
  status_->setText("reading the DEM");
  progress_->setRange(0, 0);
  job_.start(work, done, hooks_of_job());
  update_buttons();
}

void ScanPanel::ask_for_place() {
  with_ground([this] {
    status_->setText("Press at its position, and drag in its direction.");
    if (hooks_.take_place) hooks_.take_place();
  });
}

void ScanPanel::place_at(const glm::dvec3& at_w_m, const glm::dvec3& towards_w_m) {
  with_ground([this, at_w_m, towards_w_m] { put(at_w_m, towards_w_m); });
}

void ScanPanel::put(const glm::dvec3& at_w_m, const glm::dvec3& towards_w_m) {
  const glm::dvec3 ahead = towards_w_m - at_w_m;
  if (math::hypot(ahead.x, ahead.y) > 0) {
    heading_->setValue(glm::degrees(math::atan2(ahead.y, ahead.x)));
  }
  at_m_ = glm::dvec2(at_w_m - simulation_->terrain.header().origin_w_m);
  status_->clear();
  show_place();
}

void ScanPanel::show_place() {
  if (!at_m_) return;
  try {
    const Pose X_DS = pose_at(place(), simulation_->terrain.ground());
    const glm::dvec3 origin_w_m = simulation_->terrain.header().origin_w_m;
    const glm::dvec3 p_w_m = origin_w_m + X_DS.translation_m;
    where_->setText(text_of("{:.2f} E, {:.2f} N,\n{:.2f} m up", p_w_m.x, p_w_m.y, p_w_m.z));
    LineDrawing axes;
    add_axes(axes, X_DS, marker_m);
    if (hooks_.show)
      hooks_.show(line_layer("scan here/place", LayerKind::Sensors, origin_w_m, axes, 3));
  } catch (const std::exception& error) {
    at_m_.reset();
    where_->setText("none yet");
    status_->setText(error.what());
  }
  update_buttons();
}

void ScanPanel::scan() {
  const int index = preset_->currentIndex();
  if (simulation_ == nullptr || !at_m_ || index < 0 || is_scanning()) return;
  if (scanner_ == nullptr) scanner_ = std::make_shared<SceneScanner>(*simulation_);
  const SensorPreset preset = presets_[static_cast<std::size_t>(index)];
  const std::string name = fmt::format("scan here/{} {}", ++scans_, preset.name);
  const auto work = [simulation = simulation_, scanner = scanner_, where = place(), preset, name](
                        const std::stop_token& stop, const JobProgress& report) {
    const Pose X_DS = pose_at(where, simulation->terrain.ground());
    PlacedScan placed = scanner->scan(preset.lidar, X_DS, stop, report);
    return made_of(*simulation, preset, X_DS, std::move(placed), name);
  };
  const auto done = [this](FinishedScan made) {
    status_->setText(text_of("{} echoes. {}", made.scan.cloud->rows(), fmt::join(made.notes, " ")));
    if (hooks_.scanned) hooks_.scanned(std::move(made));
  };
  progress_->setRange(0, progress_steps);
  progress_->setValue(0);
  status_->setText("starting");
  job_.start(work, done, hooks_of_job());
  update_buttons();
}

Job::Hooks ScanPanel::hooks_of_job() {
  return {.progress =
              [this](double share, const std::string& step) {
                progress_->setValue(static_cast<int>(share * progress_steps));
                status_->setText(QString::fromStdString(step));
              },
          .failed =
              [this](const std::string& fault) {
                status_->setText("failed");
                if (hooks_.failed) hooks_.failed(fault);
              },
          .cancelled = [this] { status_->setText("cancelled"); },
          .ended = [this] { update_buttons(); }};
}

void ScanPanel::cancel() {
  if (!is_scanning()) return;
  status_->setText("stopping");
  job_.cancel();
}

}  // namespace groundray
