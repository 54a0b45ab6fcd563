#!/usr/bin/env bash
# Opens a page of a study or of a replay in a headless browser: as wide as a desktop and as narrow as a phone, light and
# dark. The page must raise no error, fetch nothing, not scroll sideways, and have at least one of each THING: those of
# a study, unless others are named.
# usage: tests/page.sh PAGE.html [THING…]
set -euo pipefail
page=$1
shift
things=("$@")
if [[ $# == 0 ]]; then
    things=(charts advice replays inked turned scrubbed)
fi
browser=$(command -v chromium || command -v google-chrome || true)
if [[ -z $browser ]]; then
    echo "no browser is installed"
    exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Examines the page from within, and sends the findings to the page around it.
cat > "$folder/probe" << 'END'
<script>
const faults = [];
addEventListener("error", (event) => faults.push(event.message));
addEventListener("load", () => {
  const count = (what) => document.querySelectorAll(what).length;
  const behind = () => getComputedStyle(document.body).backgroundColor;
  const [wide, narrow] = [document.documentElement.scrollWidth, innerWidth];
  const fetched = performance.getEntriesByType("resource").length;
  const found = { faults, fetched, beyond: Math.max(0, wide - narrow), charts: count("#scenes svg"),
    advice: count("#advice tr"), replays: count("#replays canvas"), said: count("#overall li"), was: behind() };
  document.getElementById("theme").click();
  found.is = behind();
  const canvases = [...document.querySelectorAll("#replays canvas")];
  const pixels = (canvas) => new Uint32Array(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer);
  found.inked = canvases.filter((canvas) => new Set(pixels(canvas)).size > 3).length;
  // The number of canvases that look different after an action.
  const changed = (act) => canvases.filter((canvas) => {
    const before = pixels(canvas);
    act(canvas);
    return pixels(canvas).some((pixel, place) => pixel !== before[place]);
  }).length;
  found.scrubbed = changed((canvas) => {
    const slider = canvas.parentElement.querySelector("input[type=range]");
    slider.value = slider.max;
    slider.dispatchEvent(new Event("input"));
  });
  found.turned = changed((canvas) => canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" })));
  found.zoomed = changed((canvas) => canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -200, cancelable: true })));
  found.arrows = changed((canvas) => [...canvas.parentElement.querySelectorAll("button")].find((it) => it.textContent === "arrows")?.click());
  found.differences = document.querySelectorAll("#replays .keys .differs").length;
  parent.postMessage(JSON.stringify(found), "*");
});
</script>
END
sed "/<head>/r $folder/probe" "$page" > "$folder/page.html"

look() { # WIDTH, THEME (0 dark, 1 light)
    cat > "$folder/around.html" << END
<pre id="found"></pre><iframe src="page.html" width="$1" height="800"></iframe>
<script>addEventListener("message", (event) => document.getElementById("found").textContent = event.data);</script>
END
    timeout 120 "$browser" --headless --no-sandbox --disable-gpu --disable-quic --no-first-run \
        --disable-background-networking --disable-component-update --disable-sync \
        --user-data-dir="$folder/profile" --window-size=1300,900 --virtual-time-budget=5000 \
        "--blink-settings=preferredColorScheme=$2" --dump-dom "file://$folder/around.html" 2> /dev/null |
        sed -n 's/.*<pre id="found">\(.*\)<\/pre>.*/\1/p'
}

for width in 1100 390; do
    for theme in 1 0; do
        found=$(look "$width" "$theme")
        echo "$width pixels, theme $theme: $found"
        [[ $found == '{"faults":[],"fetched":0,"beyond":0,'* ]]
        for something in "${things[@]}"; do
            grep -Eq "\"$something\":[1-9]" <<< "$found"
        done
        light='"was":"rgb(251, 252, 254)"' dark='"was":"rgb(16, 21, 29)"'
        [[ $found == *"$([[ $theme == 1 ]] && echo "$light" || echo "$dark")"* ]]
        # The button switches between the two themes.
        [[ $found =~ \"was\":(.*),\"is\":(.*),\"inked\" && ${BASH_REMATCH[1]} != "${BASH_REMATCH[2]}" ]]
    done
done
echo "the page stands in a browser"
