// The modules as a tree, for the keyboard and for who listens: legs below what carries them.

import { ofType } from "./colours.js";

const [FRONT, BACK] = [0, 1];
/** More are not listed: the picture and the keys reach them all. */
const MOST = 1000;

/** The modules in the order in which they hang together, each with its depth. */
function ordered(run, time) {
    const { peers } = run.wiring(time);
    const found = new Set();
    const order = [];
    // Along the body first, and to the sides one deeper.
    const visit = (first, depth) => {
        for (let module = first; module !== undefined && !found.has(module);) {
            found.add(module);
            order.push({ module, depth });
            const behind = peers[module][BACK];
            for (let dock = 0; dock < 6; dock++) {
                const peer = peers[module][dock];
                if (peer && dock !== BACK && dock !== FRONT && !found.has(peer.module))
                    visit(peer.module, depth + 1);
            }
            module = behind?.dock === FRONT ? behind.module : undefined;
        }
    };
    const isFirst = (module) => !peers[module][FRONT] && peers[module][BACK]?.dock === FRONT;
    for (let module = 0; module < run.modules; module++) if (isFirst(module)) visit(module, 1);
    for (let module = 0; module < run.modules; module++) if (!found.has(module)) visit(module, 1);
    return order.slice(0, MOST);
}

export class Tree {
    constructor(element, run, select) {
        Object.assign(this, { element, run, select, wiring: null, items: [], names: [] });
        element.addEventListener("click", (event) => {
            const item = event.target.closest("[role=treeitem]");
            if (item) select(Number(item.dataset.module));
        });
        element.addEventListener("keydown", (event) => this.key(event));
    }

    key(event) {
        const at = this.items.indexOf(document.activeElement);
        const to = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: this.items.length - 1 }[event.key];
        const item = to === undefined ? document.activeElement : this.items[to];
        if (!item?.dataset?.module) return;
        if (to === undefined && event.key !== "Enter") return;
        event.preventDefault();
        event.stopPropagation();
        item.focus();
        this.select(Number(item.dataset.module));
    }

    /** Brings it up to date. */
    show(time, selected) {
        const wiring = this.run.wiring(time);
        if (wiring !== this.wiring) this.build(time, wiring);
        this.items.forEach((item, index) => {
            const module = Number(item.dataset.module);
            const type = this.run.type(module, time);
            if (this.names[index] !== type) {
                this.names[index] = type;
                item.firstChild.style.background = ofType(type);
                item.lastChild.textContent = `${module} ${type}`;
            }
            const isSelected = String(module === selected);
            if (item.getAttribute("aria-selected") !== isSelected)
                item.setAttribute("aria-selected", isSelected);
        });
        const focus = this.items.findIndex((item) => Number(item.dataset.module) === selected);
        this.items.forEach((item, index) => (item.tabIndex = index === Math.max(0, focus) ? 0 : -1));
    }

    build(time, wiring) {
        this.wiring = wiring;
        this.names = [];
        const order = ordered(this.run, time);
        this.items = order.map(({ module, depth }) => {
            const item = document.createElement("div");
            item.setAttribute("role", "treeitem");
            item.setAttribute("aria-level", depth);
            item.dataset.module = module;
            item.style.marginLeft = `${14 * (depth - 1)}px`;
            item.append(document.createElement("i"), document.createElement("span"));
            return item;
        });
        this.element.replaceChildren(...this.items);
    }

    /** Brings the selected module into sight. */
    reveal(selected) {
        this.items
            .find((item) => Number(item.dataset.module) === selected)
            ?.scrollIntoView({ block: "nearest" });
    }
}
