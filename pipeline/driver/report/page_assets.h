#pragma once
// Style and script of the report's page. Nothing is loaded from anywhere.

#include <string_view>

namespace drench {

inline constexpr std::string_view report_style = R"css(
:root { color-scheme: dark; }
* { box-sizing: border-box; }
body { margin: 0; background: #181a1f; color: #d8dbe2; font: 15px/1.5 system-ui, sans-serif; }
header, section { max-width: 1560px; margin: 0 auto; padding: 14px 24px; }
header { padding-top: 26px; }
h1 { margin: 0; font-size: 26px; font-weight: 600; }
h2 { margin: 14px 0 10px; font-size: 18px; font-weight: 600; border-bottom: 1px solid #343945; padding-bottom: 4px; }
.facts span { display: inline-block; margin: 8px 18px 0 0; color: #9aa3b2; }
.facts b { color: #d8dbe2; font-weight: 600; }
.facts .live { color: #7fd88f; } .facts .ended { color: #ffb454; }
progress { width: 120px; accent-color: #6ab7ff; }
.warnings { border-left: 3px solid #ffb454; padding: 4px 12px; background: #24262d; }
.sheet { display: grid; grid-template-columns: repeat(auto-fill, minmax(210px, 1fr)); gap: 6px; }
.sheet button { position: relative; padding: 0; border: 2px solid transparent; background: #000; cursor: zoom-in; }
.sheet button:focus-visible { border-color: #6ab7ff; outline: none; }
.sheet img { display: block; width: 100%; }
.sheet span { position: absolute; left: 0; bottom: 0; padding: 0 6px; color: #fff; background: rgb(0 0 0 / 55%); font-size: 13px; }
.missing { display: grid; place-items: center; aspect-ratio: 16/9; color: #70798a; background: #20232a; }
dialog { position: fixed; inset: 0; width: 100vw; height: 100vh; max-width: none; max-height: none; margin: 0; padding: 0; border: 0; background: #0d0e11; color: #d8dbe2; }
dialog .stage { position: absolute; inset: 0 0 42px 0; overflow: auto; display: grid; place-items: center; }
dialog img { max-width: 100%; max-height: calc(100vh - 42px); }
dialog.whole img { max-width: none; max-height: none; }
dialog .bar { position: absolute; left: 0; right: 0; bottom: 0; height: 42px; padding: 9px 16px; background: #20232a; display: flex; gap: 18px; }
dialog .bar span:last-child { margin-left: auto; color: #9aa3b2; }
video { max-width: 100%; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: 4px 14px 4px 0; border-bottom: 1px solid #2b2f38; vertical-align: top; }
th { color: #9aa3b2; font-weight: 500; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(440px, 1fr)); gap: 12px; }
svg { width: 100%; background: #1f2229; border-radius: 4px; }
svg .title { fill: #d8dbe2; font-size: 13px; }
svg .tick { fill: #9aa3b2; font-size: 11px; }
svg .legend { font-size: 11px; }
svg .grid { stroke: #343945; fill: none; }
svg .line { fill: none; stroke-width: 1.6; }
svg .dots { stroke: none; fill-opacity: 0; }
svg .dots circle:hover { fill-opacity: 1; }
code { background: #24262d; padding: 1px 6px; border-radius: 3px; overflow-wrap: anywhere; }
footer { color: #70798a; padding: 10px 24px 40px; max-width: 1560px; margin: 0 auto; }
)css";

/// Opens a frame at full size: arrows, Home and End step, space plays, B shows the other run, Z the
/// frame's own pixels, Escape closes.
inline constexpr std::string_view report_script = R"js(
const viewer = document.querySelector('dialog');
const picture = viewer.querySelector('img');
const [label, hint] = viewer.querySelectorAll('.bar span');
let data, shown, at = 0, other = false, timer = 0;
function load() {
  data = JSON.parse(document.getElementById('data').textContent);
  shown = data.images;
}
load();
const buttons = () => [...document.querySelectorAll('.sheet button')];
function show(k) {
  at = (k + shown.length) % shown.length;
  const image = shown[at];
  const source = other && image.b ? image.b : image.a;
  picture.src = document.getElementById(source).textContent;
  picture.alt = 'frame ' + image.frame;
  label.textContent = 'frame ' + image.frame + (image.b ? other ? '  B: ' + data.b : '  A: ' + data.a : '');
}
function stop() { clearInterval(timer); timer = 0; }
function play() { if (timer) stop(); else timer = setInterval(() => show(at + 1), 1000 / data.fps); }
document.addEventListener('click', event => {
  const k = buttons().indexOf(event.target.closest('.sheet button'));
  if (k >= 0) { show(k); viewer.showModal(); }
});
viewer.addEventListener('close', () => { stop(); buttons()[at].focus(); });
viewer.addEventListener('click', event => { if (event.target !== picture) viewer.close(); });
picture.addEventListener('click', () => viewer.classList.toggle('whole'));
document.addEventListener('keydown', event => {
  if (!viewer.open) return;
  const keys = {
    ArrowRight: () => { stop(); show(at + 1); }, ArrowLeft: () => { stop(); show(at - 1); },
    Home: () => show(0), End: () => show(shown.length - 1), ' ': play,
    b: () => { other = !other; show(at); }, z: () => viewer.classList.toggle('whole'),
  };
  const key = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (key) { event.preventDefault(); key(); }
});
)js";

/// Takes what has changed from the server, unless a frame is being looked at.
inline constexpr std::string_view watch_script = R"js(
async function refresh() {
  const state = await (await fetch('state')).text();
  if (state === data.state || viewer.open) return;
  const page = new DOMParser().parseFromString(await (await fetch('./')).text(), 'text/html');
  for (const part of ['header', 'main', '#texts'])
    document.querySelector(part).replaceWith(page.querySelector(part));
  load();
}
async function watch() {
  try {
    await refresh();
    setTimeout(watch, 1000);
  } catch {
    const live = document.querySelector('.live');
    live.className = 'ended';
    live.textContent = 'drench answers no more';
  }
}
watch();
)js";

}  // namespace drench
