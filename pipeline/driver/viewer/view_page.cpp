#include "pipeline/driver/viewer/view_page.h"

#include <fmt/format.h>

#include <string_view>

#include "pipeline/driver/viewer/view_script.h"

namespace drench {

namespace {

constexpr std::string_view style = R"css(
:root { color-scheme: dark; }
* { box-sizing: border-box; }
body { margin: 0; overflow: hidden; background: #14161a; color: #d8dbe2; font: 13px/1.45 system-ui, sans-serif; }
canvas { position: fixed; inset: 0; width: 100vw; height: 100vh; outline: none; }
#panel { position: fixed; top: 12px; left: 12px; padding: 10px 14px; background: rgb(24 26 31 / 82%); border-radius: 6px; min-width: 210px; }
#panel h1 { margin: 0 0 6px; font-size: 16px; }
#panel label { display: block; margin: 3px 0; }
#panel select, #panel input[type=range] { width: 100%; }
#bar { position: fixed; left: 0; right: 0; bottom: 0; padding: 9px 16px; background: rgb(24 26 31 / 88%); display: flex; gap: 14px; align-items: center; }
#bar input { flex: 1; }
#bar button { width: 64px; }
#legend { height: 10px; border-radius: 3px; margin: 6px 0 2px; background: linear-gradient(90deg, #1c3f94, #2f9bd8, #7fd6b4, #f4d35e, #ee5a36); }
#ends { display: flex; justify-content: space-between; color: #9aa3b2; }
#said { color: #9aa3b2; min-height: 1.4em; }
kbd { background: #2b2f38; border-radius: 3px; padding: 0 4px; }
)css";

constexpr std::string_view body = R"html(
<canvas tabindex="0" aria-label="the scene"></canvas>
<div id="panel"><h1></h1>
<label><input type="checkbox" id="particles" checked> particles <kbd>P</kbd></label>
<label><input type="checkbox" id="sheets" checked> cloth <kbd>K</kbd></label>
<label><input type="checkbox" id="fluid"> surface <kbd>M</kbd></label>
<label><input type="checkbox" id="frame"> domain and probes <kbd>D</kbd></label>
<label><input type="checkbox" id="camera"> the shot's camera <kbd>C</kbd></label>
<label>particles by <select id="colour"><option>speed<option>density<option>age</select></label>
<label>cloth by <select id="cloth"><option>shade<option>stretch<option>wetness</select></label>
<label>slice <select id="axis"><option>none<option>x<option>y<option>z</select></label>
<input type="range" id="slice" min="0" max="1" step="0.002" value="0.5" aria-label="where the slice is">
<div id="legend"></div><div id="ends"><span></span><span></span></div>
<div id="said"></div></div>
<div id="bar"><button>play</button><span id="number"></span>
<input type="range" min="0" step="1" value="0" aria-label="frame">
<span><kbd>space</kbd> <kbd>left</kbd> <kbd>right</kbd> drag, shift drag, wheel</span></div>
)html";

}  // namespace

std::string view_page() {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>drench "
      "view</title>\n<link rel=\"icon\" href=\"data:,\">\n"
      "<style>{}</style></head><body>{}<script>{}{}</script></body></html>\n",
      style, body, view_graphics, view_script);
}

}  // namespace drench
