// What the page says of the run as a whole.

import { ofLetter, ofType } from "./colours.js";
import { until } from "./run.js";
import { happened } from "./timeline.js";

const by = (id) => document.getElementById(id);

/** Says what run it is. */
export function head(run, speeds) {
    const { about } = run;
    const name = about.robot.replaceAll(/[-_]/g, " ");
    by("title").textContent = `${name[0].toUpperCase()}${name.slice(1)} of ${run.modules}`;
    document.title = `SuperBot: ${name} of ${run.modules}`;
    by("speed").replaceChildren(
        ...speeds.map((pace) => new Option(pace < 0.1 ? `1/${Math.round(1 / pace)}` : `${pace}×`, pace)),
    );
    showEnd(about);
}

/** Says how it did, once that is known. */
export function showEnd({ summary, faults }) {
    by("report").hidden = !summary;
    by("summary").textContent = summary;
    by("faults").hidden = !faults.length;
    by("faults").textContent = faults.join("; ");
}

/** Says what the colours mean that there are. */
export function showLegend(run) {
    const types = new Set(run.views.flat().flatMap(({ type }) => type ?? []));
    const letters = new Set(run.hormones.map(({ letter }) => letter));
    const entry = (colour, text, shape = "") => {
        const item = document.createElement("li");
        const swatch = document.createElement("i");
        Object.assign(swatch, { className: shape });
        swatch.style.background = colour;
        item.append(swatch, text);
        return item;
    };
    by("legend").replaceChildren(
        ...[...types].sort().map((type) => entry(ofType(type), type)),
        ...[...letters]
            .sort()
            .map((letter) => entry(ofLetter(letter), `hormone ${run.about.letters[letter]}`, "round")),
    );
}

/** Says how far it has come by a time. */
export function showFacts(run, time) {
    const facts = [`${until(run.deliveries, time, (at) => at)} hormones arrived`];
    if (run.countsLosses && run.losses.length) {
        const lost = run.losses
            .slice(0, until(run.losses, time))
            .reduce((sum, { frames }) => sum + frames, 0);
        facts.push(`${lost} frames lost`);
    }
    if (run.about.ground) {
        const way = run.place(0, time).x - run.place(0, 0).x;
        facts.push(`${way.toFixed(2)} m ahead`);
    } else {
        facts.push("no world: joints alone");
    }
    const event = happened(run, time);
    by("facts").textContent = facts.join(" · ") + (event ? ` — ${event}` : "");
}
