"use strict";
(() => {
  const paper = document.querySelector(".paper");
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  let kept = null;

  const numberOf = (target) => target.closest?.("[data-sentence]")?.dataset.sentence ?? null;

  const light = (number) => {
    for (const part of document.querySelectorAll(".lit")) part.classList.remove("lit");
    paper.classList.toggle("some", false);
    if (number === null) return;
    const parts = document.querySelectorAll(`[data-sentence="${number}"]`);
    for (const part of parts) part.classList.add("lit");
    paper.classList.toggle("some", paper.querySelector(".lit") !== null);
  };

  const show = (place) => place?.scrollIntoView({ block: "nearest", behavior: calm.matches ? "auto" : "smooth" });

  document.addEventListener("pointerover", (event) => {
    if (event.pointerType !== "touch") light(numberOf(event.target) ?? kept);
  });
  document.addEventListener("focusin", (event) => light(numberOf(event.target) ?? kept));
  document.addEventListener("focusout", () => light(kept));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") light((kept = null));
  });
  document.addEventListener("click", (event) => {
    const number = numberOf(event.target);
    const link = event.target.closest?.("a");
    if (number === null || !(link || paper.contains(event.target))) {
      light((kept = null));
      return;
    }
    event.preventDefault();
    kept = number;
    light(kept);
    const mark = [...paper.querySelectorAll(`.step[data-sentence="${number}"]`)].find((part) => part.getClientRects().length);
    const sentence = document.getElementById(`sentence-${number}`);
    if (link?.classList.contains("number")) {
      show(mark ?? paper);
      mark?.focus({ preventScroll: true });
    } else {
      show(sentence);
      (sentence.querySelector("a") ?? sentence).focus({ preventScroll: true });
    }
  });
})();
