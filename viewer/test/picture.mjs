// Makes the README's picture, or holds it against what it would be now.
// node picture.mjs FILE.png: makes it. picture.test.mjs compares.

import { writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { Browser } from "./browser.mjs";
import { recorded } from "./pages.mjs";

const [WIDTH, HEIGHT] = [1280, 560];

/** A centipede a while after a beat, when its hormones have come to the end. */
const RUN = ["--modules", "18", "--seconds", "4.2"];
const MOMENT = "#t=4.1&view=head&theme=dark&ui=off&smooth";

/** The picture as it is now, as a PNG. */
export async function taken() {
    const { page } = recorded("picture", ...RUN);
    const browser = await Browser.start({ width: WIDTH, height: HEIGHT });
    try {
        await browser.resize(WIDTH, HEIGHT);
        await browser.open(page, MOMENT);
        await browser.drawn();
        return await browser.picture();
    } finally {
        await browser.end();
    }
}

/** The share of the pixels of which a colour differs by more than `most`, of 255. */
export async function difference(one, other, most) {
    const browser = await Browser.start();
    try {
        return await browser.run(`
            const pixels = await Promise.all(arguments[0].map(async (base64) => {
                const image = new Image();
                image.src = "data:image/png;base64," + base64;
                await image.decode();
                const canvas = new OffscreenCanvas(image.width, image.height);
                const context = canvas.getContext("2d");
                context.drawImage(image, 0, 0);
                return context.getImageData(0, 0, image.width, image.height);
            }));
            const [one, other] = pixels;
            if (one.width !== other.width || one.height !== other.height) return 1;
            let differ = 0;
            for (let at = 0; at < one.data.length; at += 4) {
                differ += [0, 1, 2].some((part) => Math.abs(one.data[at + part] - other.data[at + part]) > arguments[1]);
            }
            return (4 * differ) / one.data.length;`, [one, other].map((png) => png.toString("base64")), most);
    } finally {
        await browser.end();
    }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) writeFileSync(process.argv[2], await taken());
