// A walk through a scene, played in a page: one file a thing that it is made of.

export { WalkPlayer } from "./player.js";
