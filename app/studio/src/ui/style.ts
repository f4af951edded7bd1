/** A custom property of the page's style, as it is now. */
export const style = (name: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();
