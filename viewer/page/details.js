// All that is known of the module that is selected.

import { ofLetter, ofType } from "./colours.js";

const JOINTS = ["Motor0", "Roll", "Motor2"];
const STOP = 90;

const element = (name, text = "") => Object.assign(document.createElement(name), { textContent: text });

function row(list, name, ...value) {
    const cell = element("dd");
    cell.append(...value);
    list.append(element("dt", name), cell);
}

/** An angle as a bar from the middle, and as a number. */
function bar(degrees) {
    const outside = element("span");
    outside.className = "joint";
    const inside = element("i");
    const share = (Math.min(Math.abs(degrees), STOP) / STOP) * 50;
    inside.style.left = `${degrees < 0 ? 50 - share : 50}%`;
    inside.style.width = `${share}%`;
    outside.append(inside);
    return outside;
}

export function showDetails(panel, run, time, selected) {
    if (selected === null) return panel.replaceChildren();
    const type = run.type(selected, time);
    const title = element("h2");
    const swatch = element("i");
    swatch.style.background = ofType(type);
    title.append(swatch, `Module ${selected}`);
    const list = element("dl");
    row(list, "Type", type);
    row(list, "Action", run.action(selected, time));
    const { angles, frame } = run.placing(selected, time);
    JOINTS.forEach((name, joint) => row(list, name, bar(angles[joint]), `${angles[joint].toFixed(1)}°`));
    const came = run.arrived(selected, time);
    const generated = run.last(run.generated, selected, time);
    if (came) {
        const letter = element("b", run.about.letters[came.letter]);
        letter.style.color = `color-mix(in srgb, ${ofLetter(came.letter)} 60%, currentColor)`;
        const { module, dock } = came.from;
        row(list, "Last hormone", letter, ` from ${module}.${run.about.docks[dock]}`);
        row(list, "came at", `${came.arrived.toFixed(4)} s`);
        row(list, "took", `${(1000 * (came.arrived - came.sent)).toFixed(2)} ms`);
    } else if (generated) {
        row(list, "Last hormone", `${generated.of}, its own, at ${generated.at.toFixed(3)} s`);
    }
    const { received, sent, madeGood } = run.counts(selected, time);
    row(list, "Hormones", `${received} in, ${sent} out${madeGood ? `, ${madeGood} made good` : ""}`);
    const peers = run.wiring(time).peers[selected];
    const known = run.known(selected, time);
    run.about.docks.forEach((name, dock) => {
        const peer = peers[dock];
        if (!peer && !((known >> dock) & 1)) return;
        const to = peer ? `${peer.module}.${run.about.docks[peer.dock]}` : "nothing";
        row(list, name, `${to} ${(known >> dock) & 1 ? "● found" : "○ not found"}`);
    });
    const [x, y, z] = [12, 13, 14].map((index) => frame.elements[index]);
    row(list, "At, in m", `${x.toFixed(2)}, ${y.toFixed(2)}, ${z.toFixed(2)}`);
    panel.replaceChildren(title, list);
}
