// What there is to see inside of the module that is selected, while its run goes on.

const element = (name, ...content) => {
    const made = document.createElement(name);
    made.append(...content);
    return made;
};

/** A table with a head; the first cell of a row names it. */
function table(caption, heads, rows) {
    const head = element("tr", ...heads.map((text) => element("th", text)));
    const body = rows.map(([name, ...cells]) => {
        const title = Object.assign(element("th", name), { scope: "row" });
        return element("tr", title, ...cells.map((cell) => element("td", String(cell))));
    });
    return element("table", element("caption", caption), element("thead", head), element("tbody", ...body));
}

const fixed = (list, digits) => list.map((number) => number.toFixed(digits)).join(", ");

/** By section, its name and what is in it. */
function sections({ counts, acceleration, amperes, battery, mcus, links, consoles }) {
    const sensors = [["Acceleration, g", fixed(acceleration, 2)]];
    if (amperes) sensors.push(["Motors, A", fixed(amperes, 2)]);
    if (battery) sensors.push(["Battery", `${battery[0].toFixed(2)} V, ${battery[1].toFixed(2)} %`]);
    const made = [["Sensors", [table("Sensors", ["", ""], sensors)]]];
    const tasks = mcus.map(({ name, awake_percent: awake, tasks }) => {
        const rows = tasks.map(({ name, state, stack, used }) => [name, state, `${used} of ${stack}`]);
        const percent = awake === null ? "" : `, awake ${awake.toFixed(0)} %`;
        return table(`${name}${percent}`, ["Task", "does", "stack"], rows);
    });
    if (tasks.length) made.push(["Tasks", tasks]);
    if (links.length) {
        const rows = links.map((link) => [
            link.dock,
            link.sent,
            link.received,
            link.repeated,
            link.errors,
            link.gave_up,
        ]);
        made.push(["Links", [table("Frames", ["Dock", "sent", "came", "again", "errors", "lost"], rows)]]);
    }
    if (counts.length) made.push(["Counts", [table("Hormones", ["", ""], counts)]]);
    if (consoles.length) {
        const texts = consoles.map(({ asked, text, is_complete: isWhole }) =>
            element("pre", `asked at ${asked.toFixed(2)} s\n${text}${isWhole ? "" : "..."}`),
        );
        made.push(["Console", texts]);
    }
    return made;
}

/** Shows that; what is open stays open. */
export function showInside(panel, inside) {
    const wanted = inside ? sections(inside) : [];
    const names = [...panel.children].map(({ dataset }) => dataset.name);
    if (names.join() !== wanted.map(([name]) => name).join()) {
        const open = new Set(
            [...panel.children].filter((made) => made.open).map((made) => made.dataset.name),
        );
        panel.replaceChildren(
            ...wanted.map(([name]) => {
                const made = element("details", element("summary", name), element("div"));
                made.dataset.name = name;
                made.open = open.has(name);
                return made;
            }),
        );
    }
    wanted.forEach(([, content], index) => panel.children[index].lastChild.replaceChildren(...content));
}
