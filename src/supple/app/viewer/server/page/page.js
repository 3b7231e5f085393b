// Runs before viser's client. `suppleChanges` changes its program; the rest draws the overlay that the server sends.
"use strict";
(() => {
  // What is changed in the program of viser's client: a pattern, and what replaces it.
  const CHANGES = {
    // The state of the client, for this script.
    state: [/(\w+)=\{messageSource:(?=\w+,useSceneTree:)/, "$1=globalThis.suppleViewer={messageSource:"],
    // The arrow of a drag: the server draws the spring.
    arrow: [/(,16747586,\.18,\.09\);return )(\w+)\.visible=!1,/, "$1$2.visible=$2.line.visible=$2.cone.visible=!1,"],
    // Only the body that is held has an outline, and it is thin.
    outline: [
      /\.visible=(\w+)\.state\.current\.isHovered\)\}\),(\(0,\w+\.jsx\)\(\w+,\{ref:\w+,thickness:)10/,
      ".visible=globalThis.suppleIsHeld($1.state))}),$23",
    ],
    // On a phone, the panel is a drawer as wide as the screen, closed at first.
    drawer: [/(,\[\w+,\{toggle:\w+\}\]=\w+\()!0(?=\);return\(0,\w+\.jsx\)\(\w+\.Provider,\{value:\{wrapperRef:)/, "$1!1"],
    width: [/(minHeight:`3\.5em`,maxHeight:`60%`,width:)`20em`(.{0,160}?style:\{width:)`20em`/, "$1`100%`$2`100%`"],
    // Moves of a drag are sent at every picture, not every 50 ms.
    rate: [/(\{send:\w+,flush:\w+\}=\w+\()50\)/, "$116)"],
    // Messages are drawn when they arrive: the client would hold them back to smooth their rate, after a late one for
    // many pictures.
    pacing: [/(\w+)>3\)\{let (\w+)=\.95;(?=setTimeout)/, "$1>1/0){let $2=.95;"],
    // The first message after a picture changes the scene at once, so that the next picture shows it. The client would
    // take it up while it draws that picture, and show it in the one after.
    queue: [
      /(\w+)(&&document\.hidden\?\((\w+)\(\),(\w+)\.requestRender\(\)\):\w+\?\3\(\):)\4\.requestRender\(\)/,
      "$1$2($1&&suppleIsFirst()&&$3(),$4.requestRender())",
    ],
    // Where the view is at first and after it is reset: in a narrow picture, farther away.
    reset: [
      /(\w+)(\.applyMatrix4\((\w+)\);let (\w+)=new \w+\(\.\.\.\w+\.lookAt\.value\);\4\.applyMatrix4\(\3\),)/,
      "$1$2suppleReset($1,$4),",
    ],
    // The arrow keys to the sides: the right one takes a step.
    keys: [/\.has\(`Arrow(?:Left|Right)`\)/g, ".has(``)"],
  };
  globalThis.suppleMissing = [];
  globalThis.suppleChanges = (code) => {
    for (const [name, [pattern, replacement]] of Object.entries(CHANGES)) {
      const changed = code.replace(pattern, replacement);
      if (changed === code) suppleMissing.push(name);
      code = changed;
    }
    if (suppleMissing.length) console.warn(`Supple: not changed in viser's client: ${suppleMissing}`);
    return code;
  };

  // Once for each picture, so that a slow browser takes up all that came meanwhile together.
  let taken = false;
  globalThis.suppleIsFirst = () => {
    if (taken) return false;
    requestAnimationFrame(() => { taken = false; });
    return (taken = true);
  };

  // For shadows, the scene is drawn three times more. Where pictures take long, shadows follow only every SHADOWS [ms],
  // for SPARING [ms]; then the browser is tried again. Called at every picture: whether it needs new shadows.
  const SLOW = 22, SHADOWS = 250, SPARING = 30_000;
  globalThis.suppleShadows = () => {
    let drawnAt = -Infinity, shadowsAt = -Infinity, sparingUntil = -Infinity, pace = 0;
    return (now) => {
      const gap = now - drawnAt;
      drawnAt = now;
      if (gap < SHADOWS) pace += 0.1 * (Math.min(gap, 50) - pace);  // otherwise there was nothing to draw
      if (now < sparingUntil) pace = 0;
      else if (pace > SLOW) [sparingUntil, pace] = [now + SPARING, 0];
      if (now < sparingUntil && now - shadowsAt < SHADOWS) return false;
      shadowsAt = now;
      return true;
    };
  };
  const needsShadows = suppleShadows();
  function beforePicture({ shadowMap }) {
    shadowMap.autoUpdate = false;
    const captured = suppleViewer.mutable.current.getRenderRequestState !== "ready";
    if (needsShadows(performance.now()) || captured) shadowMap.needsUpdate = true;
  }
  let attached = null;
  function attachToPictures() {
    const scene = suppleViewer.mutable.current.scene;
    if (scene && scene !== attached) (attached = scene).onBeforeRender = beforePicture;
  }

  // The body that was under the pointer when the button went down is held until the button goes up.
  const onCanvas = (event) => event.target instanceof HTMLCanvasElement;
  let holds = false, held = new Map();
  const hold = (now) => {
    [holds, held] = [now, new Map()];
    globalThis.suppleViewer?.mutable.current.requestRender();
  };
  globalThis.suppleIsHeld = (hover) => {
    if (!holds) return false;
    if (!held.has(hover)) held.set(hover, hover.current.isHovered);
    return held.get(hover);
  };
  addEventListener("pointerdown", (event) => hold(onCanvas(event) && event.button === 0), true);
  for (const kind of ["pointerup", "pointercancel"]) addEventListener(kind, () => hold(false), true);
  addEventListener("blur", () => hold(false));  // of the window: without capture, not that of a button which loses the focus to the canvas

  const send = (uuid, value) =>
    suppleViewer.mutable.current.sendMessage({ type: "GuiUpdateMessage", uuid, updates: { value } });

  // The theme of the system.
  const dark = matchMedia("(prefers-color-scheme: dark)");
  function follow() {
    const theme = suppleViewer.useGui.get().theme;
    if (theme.dark_mode !== dark.matches) suppleViewer.guiActions.setTheme({ ...theme, dark_mode: dark.matches });
  }

  // The overlay: what the server writes in HTML elements of the panel that are not displayed there. Their parts have
  // an id each, and are replaced where they have changed.
  const MARK = '<div class="supple-overlay"';
  const watched = new Set(), parts = new Map();
  let pointer = null, layer;
  function findOverlays() {
    for (const [uuid, element] of Object.entries(suppleViewer.useGuiConfig.getAll())) {
      if (watched.has(uuid) || !element?.props?.content?.startsWith?.(MARK)) continue;
      watched.add(uuid);
      suppleViewer.useGuiConfig.subscribe(uuid, () => draw(uuid));
      draw(uuid);
    }
  }
  function draw(uuid) {
    const element = suppleViewer.useGuiConfig.get(uuid);
    const source = new DOMParser().parseFromString(element?.props.content ?? "", "text/html");
    const present = new Set();
    for (const part of source.querySelectorAll(".supple-overlay > [id]")) {
      present.add(part.id);
      if (part.dataset.pointer) pointer = part.dataset.pointer;
      const text = part.outerHTML, old = document.getElementById(part.id);
      if (parts.get(part.id)?.text === text && old) continue;
      parts.set(part.id, { text, uuid });
      old ? old.replaceWith(part) : layer.append(part);
    }
    for (const [id, part] of parts)
      if (part.uuid === uuid && !present.has(id)) { parts.delete(id); document.getElementById(id)?.remove(); }
    if (!element) watched.delete(uuid);
    place();
  }
  // The overlay is as wide as the picture beside the panel.
  function place() {
    const box = suppleViewer.mutable.current.canvas?.getBoundingClientRect();
    if (box && layer) Object.assign(layer.style, {
      left: `${box.left}px`, top: `${box.top}px`, width: `${box.width}px`, height: `${box.height}px` });
    keepInPicture();
  }
  // Where the picture becomes narrower than it is high, or wider again, the camera moves such that as much stays in it.
  let narrow = null;
  const sine = (half, aspect) => Math.sin(Math.atan(Math.tan(half) * aspect));
  function narrowness() {
    const box = suppleViewer.mutable.current.canvas?.getBoundingClientRect();
    return box?.width && box.height ? Math.min(1, box.width / box.height) : null;
  }
  function keepInPicture() {
    const control = suppleViewer.mutable.current.cameraControl, now = narrowness();
    if (!control || narrow === null || now === null || now === narrow) return;
    const half = (control.camera.fov * Math.PI) / 360;
    control.dollyTo((control.distance * sine(half, narrow)) / sine(half, now), false);
    narrow = now;
  }
  globalThis.suppleReset = (eye, center) => {
    narrow = narrowness() ?? 1;
    const half = suppleViewer.useInitialCamera.get().fov.value / 2;
    eye.sub(center).multiplyScalar(sine(half, 1) / sine(half, narrow)).add(center);
  };

  // The values of sliders with their units: a text input of the panel that is not displayed, whose label names the
  // slider, takes the place of the slider's number.
  const BESIDE = "beside ";
  function findValues() {
    for (const element of Object.values(suppleViewer.useGuiConfig.getAll())) {
      const label = element?.props?.label;
      if (element?.type !== "GuiTextMessage" || !label?.startsWith?.(BESIDE)) continue;
      const slider = document.getElementById(label.slice(BESIDE.length)), row = slider?.parentElement;
      if (!row) continue;
      let box = row.querySelector("input.supple-value");
      if (!box) {
        row.classList.add("supple-row");
        box = row.appendChild(Object.assign(document.createElement("input"), { className: "supple-value", spellcheck: false }));
        // As viser's own inputs: the server does not answer where it keeps the text as it was typed.
        box.addEventListener("change", () => {
          suppleViewer.guiActions.updateGuiProps(box.dataset.uuid, { value: box.value });
          send(box.dataset.uuid, box.value);
        });
        box.addEventListener("keydown", (event) => { if (event.key === "Enter") box.blur(); });
        box.addEventListener("focus", () => box.select());
      }
      box.dataset.uuid = element.uuid;
      box.setAttribute("aria-label", document.querySelector(`label[for="${slider.id}"]`)?.textContent ?? "");
      if (document.activeElement !== box && box.value !== element.value) box.value = element.value;
    }
  }

  // A button of the overlay, with the input of the panel that it sets.
  addEventListener("click", (event) => {
    const button = event.target.closest?.("[data-press]");
    if (button) send(button.dataset.press, button.dataset.value ?? true);
    if (event.target.closest?.("#supple-keys")) toggleKeys();
    // After a click with the mouse, the space bar is not for the tab.
    if (event.detail) event.target.closest?.("[role=tab]")?.blur();
  });

  // The place of the pointer, for the value of the field there: (x, y) from -1 to 1, y upwards.
  let moved = null;
  addEventListener("pointermove", (event) => { moved = onCanvas(event) && event.buttons === 0 ? event : null; }, true);
  let sent = "";
  function sendPointer() {
    if (pointer === null || document.hidden) return;
    const box = suppleViewer.mutable.current.canvas?.getBoundingClientRect();
    let text = "";
    if (moved && box && document.getElementById("supple-legend")) {
      const x = (2 * (moved.clientX - box.left)) / box.width - 1, y = 1 - (2 * (moved.clientY - box.top)) / box.height;
      text = `${x.toFixed(4)} ${y.toFixed(4)}`;
      const label = document.getElementById("supple-value");
      if (label) label.style.transform = `translate(${moved.clientX - box.left + 14}px, ${moved.clientY - box.top + 14}px)`;
    }
    if (text !== sent) send(pointer, (sent = text));
  }

  // Keys. viser's client reacts to them in every element; a list or a tab keeps its own ones, and a slider its arrows.
  const OWN = "[role=tab],[role=option],[role=listbox],[role=menu],[role=dialog],select";
  function attachKeys() {
    document.body.addEventListener("keydown", (event) => {
      const typed = event.target.closest?.("input,textarea");
      if (event.key === "?" && !typed) toggleKeys();
      if (event.key === "Escape") document.getElementById("supple-keys")?.remove();
      const own = event.key === " " ? OWN : `[role=slider],${OWN}`;
      if (/^( |Arrow)/.test(event.key) && event.target.closest?.(own)) event.stopPropagation();
      // Otherwise the space bar would also press the button that was clicked last.
      if (event.key === " " && event.target.closest?.("button")) event.target.blur();
    });
  }
  const SHOWN = { space: "Space", arrowright: "→" };
  function toggleKeys() {
    const old = document.getElementById("supple-keys");
    if (old) return old.remove();
    const panel = Object.assign(document.createElement("div"), { id: "supple-keys" });
    panel.setAttribute("role", "dialog");
    const commands = Object.values(suppleViewer.useGui.get().commands).map((each) => each.props);
    for (const [key, label] of [...commands.map((each) => [SHOWN[each.hotkey] ?? each.hotkey, each.label]),
      ["W A S D", "Move the camera"], ["?", "These keys"]]) {
      const row = panel.appendChild(document.createElement("div"));
      row.append(Object.assign(document.createElement("kbd"), { textContent: key }), label);
    }
    layer.append(panel);
  }

  function begin() {
    if (!globalThis.suppleViewer || suppleViewer.messageSource !== "websocket") return setTimeout(begin, 50);
    layer = document.body.appendChild(Object.assign(document.createElement("div"), { id: "supple-layer" }));
    follow();
    suppleViewer.useGui.subscribe(follow);
    dark.addEventListener("change", follow);
    addEventListener("resize", place);
    setInterval(() => { attachToPictures(); findOverlays(); place(); sendPointer(); findValues(); }, 80);
    attachKeys();
  }
  addEventListener("DOMContentLoaded", begin);
})();
