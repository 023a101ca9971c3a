#include "apps/view/window/panels/help.h"

#include <QDialog>
#include <QDialogButtonBox>
#include <QTextBrowser>
#include <QVBoxLayout>

namespace groundray {
namespace {

constexpr const char* help_html = R"(
<style>td { padding: 1px 14px 1px 0; } h3 { margin: 10px 0 2px 0; }</style>
<h3>Opening</h3>
<p>Drop scenes (.yaml), datasets (their folders), meshes, clouds, DEMs and pictures into the window,
or use <b>Ctrl+O</b> and, for a dataset's folder, <b>Ctrl+Shift+O</b>. Recent files are in the
menu <i>File</i>.</p>
<h3>Mouse</h3>
<table>
<tr><td>drag left</td><td>turn about the focal point; up stays up</td></tr>
<tr><td>drag in the middle, Shift + left</td><td>move</td></tr>
<tr><td>wheel, drag right</td><td>zoom: the wheel zooms towards the pointer</td></tr>
<tr><td>double click</td><td>set the focal point</td></tr>
<tr><td>click</td><td>pick an echo, a point or a triangle: shows its values, beam and footprint</td></tr>
<tr><td>Ctrl + click</td><td>put the terrain's viewpoint there</td></tr>
</table>
<h3>Keys</h3>
<table>
<tr><td>F, Home</td><td>see all</td><td>Z</td><td>see the selected layer</td></tr>
<tr><td>W A S D, Q E</td><td>fly forwards, sideways, down and up</td><td>arrows</td><td>turn</td></tr>
<tr><td>1 2 3 4</td><td>from above, south, east, oblique</td><td>+ -</td><td>nearer, farther</td></tr>
<tr><td>T</td><td>surfaces as wireframe</td><td>L</td><td>legend</td></tr>
<tr><td>Space</td><td>play, pause</td><td>, .</td><td>previous frame, next frame</td></tr>
<tr><td>N</td><td>scan here</td><td>C</td><td>compare with the truth</td></tr>
<tr><td>Ctrl+O</td><td>open files</td><td>Ctrl+Shift+O</td><td>open a dataset's folder</td></tr>
<tr><td>Ctrl+S</td><td>save a picture</td><td>Ctrl+T</td><td>save a turntable</td></tr>
<tr><td>Delete</td><td>close the selected layer</td><td>Ctrl+W</td><td>close all</td></tr>
<tr><td>Escape</td><td>cancel; clear picks</td><td>F11</td><td>full screen</td></tr>
<tr><td>F1</td><td>this page</td><td>Ctrl+Q</td><td>quit</td></tr>
</table>
<h3>Images</h3>
<p>Point at a pixel for its value; click for its ray and the surface that it hits. The wheel
zooms, a double click shows all.</p>
<h3>Scan here</h3>
<p>For a scene, or a DEM as bare ground: choose a sensor, press <i>Place it in the view</i>, press on the ground at
its position and drag in its direction; then <i>Scan</i>.</p>
<h3>Compare</h3>
<p>Choose the measured layer and the truth: a scene's ground, a DEM, or a displayed surface. Both must
be in the same frame. Deviations above the truth, or on the side that its triangles face, are positive.</p>
)";

}  // namespace

QString help_text() { return QString::fromUtf8(help_html); }

void show_help(QWidget* parent) {
  auto* dialog = new QDialog(parent);
  dialog->setObjectName("help");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle("Mouse and keys");
  auto* browser = new QTextBrowser;
  browser->setHtml(help_text());
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close);
  QObject::connect(buttons, &QDialogButtonBox::rejected, dialog, &QDialog::close);
  auto* layout = new QVBoxLayout(dialog);
  layout->addWidget(browser);
  layout->addWidget(buttons);
  dialog->resize(720, 640);
  dialog->show();
}

}  // namespace groundray
